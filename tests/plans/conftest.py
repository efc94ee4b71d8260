"""Runs of plans on trajectories that are cut down, in simulators that all tests share, maybe by a
scripted model."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from infthor_eval.runs import PreparedRun, RunOutcome, execute
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

from ..episodes.interrupted import simulator_calls  # noqa: F401 - a fixture
from ..episodes.pool import pool, shared_simulators  # noqa: F401 - fixtures
from ..episodes.preparing import make_preparer
from ..helpers.trajectories import FORK, cut_trajectory, write_trajectories
from .scripting import ScriptedModel


@pytest.fixture(scope="module")
def simulator() -> Iterator[Simulator]:
    """A simulator of its own for a module's tests, which keeps copies and segments nothing."""
    with Simulator(embedded_launch(), instances=False, max_copies=64) as simulator:
        yield simulator


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with the first task of a kitchen."""
    return write_trajectories(tmp_path / "data", cut_trajectory(FORK))


@pytest.fixture
def prepare_run(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """Prepares a run on that, see `make_preparer`."""
    return make_preparer("planner", tasks=("infthor_plans",), data=data, output=tmp_path / "out")


@pytest.fixture
def run_scripted(
    prepare_run: Callable[..., PreparedRun], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[RunOutcome, ScriptedModel]]:
    """Runs a scripted model: gives the outcome, and the model with what it was asked."""

    def run_scripted(say, **changes):
        model = ScriptedModel(say)
        monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: model)
        return execute(prepare_run(ScriptedModel.name, **changes)), model

    return run_scripted


@pytest.fixture
def brief(task_files: Path) -> None:
    """Plans are over after four actions."""
    (task_files / "plans" / "infthor_plans.yaml").write_text(
        "include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {max_steps: 4}\n"
    )
