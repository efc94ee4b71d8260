"""Runs and episodes of arms on trajectories that are cut down, in simulators that all tests
share."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.runs import PreparedRun
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

from ..episodes.interrupted import simulator_calls  # noqa: F401 - a fixture
from ..episodes.pool import Pool, pool, shared_simulators  # noqa: F401 - fixtures
from ..episodes.preparing import make_preparer
from ..helpers.trajectories import MUG, cut_trajectory, write_trajectories
from .arena import Arena
from .scripted import ScriptedPolicy


@pytest.fixture(scope="session")
def arena(
    pool: Pool,  # noqa: F811 - the fixture
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Callable[..., Arena]]:
    """Makes the arena of a bundled trajectory, cut to so many plans; each has an arm's simulator of
    its own."""
    arenas: dict[tuple[str, int], Arena] = {}
    with ExitStack() as opened:

        def make(name: str, n_plans: int) -> Arena:
            if (name, n_plans) not in arenas:
                data = write_trajectories(
                    tmp_path_factory.mktemp("arena") / "data", cut_trajectory(name, n_plans)
                )
                options = {"image": False, "instances": False}
                arm = Simulator(embedded_launch(), max_copies=64, agentMode="arm", **options)  # type: ignore[arg-type]
                opened.enter_context(arm)
                with pool.one(**options) as expert:
                    arenas[name, n_plans] = Arena(data, expert, arm)
            return arenas[name, n_plans]

        yield make


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with a pick-up and a put of a mug."""
    return write_trajectories(tmp_path / "data", cut_trajectory(MUG))


@pytest.fixture
def prepare_run(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """Prepares a run on that, see `make_preparer`."""
    return make_preparer("planner-arm", tasks=("manipulathor",), data=data, output=tmp_path / "out")


@pytest.fixture
def policy(monkeypatch: pytest.MonkeyPatch) -> Callable[..., ScriptedPolicy]:
    """Has runs load a scripted policy."""

    def make(gives: Callable[[int], Any]) -> ScriptedPolicy:
        policy = ScriptedPolicy(gives)
        monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: policy)
        return policy

    return make


@pytest.fixture
def task_file(task_files: Path) -> Callable[..., None]:
    """Has the tasks of pick-ups and puts say something more in their `dataset_kwargs`."""

    def write_tasks(settings: str, kinds: tuple[str, ...] = ("pickup", "put")) -> None:
        for kind in kinds:
            (task_files / "manipulation" / f"manipulathor_{kind}.yaml").write_text(
                f"include: _manipulation.yaml\ntask: manipulathor_{kind}\n"
                f"dataset_kwargs: {{kind: {kind}, {settings}}}\n"
            )

    return write_tasks
