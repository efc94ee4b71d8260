"""Runs of every suite to export, and the command."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.cli import main
from tests.helpers.arm_runs import make_arm_run, make_episode_record
from tests.helpers.command_line import option_words, read_success
from tests.helpers.journals import write_run
from tests.helpers.twin_sets import write_twin_set

SCHEMAS = Path(__file__).parents[2] / "../shared/data/every_eval_ever"


def _start(**options: object) -> Path:
    """Run a model on a task; returns the folder of the run."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in option_words(**options)])
    assert ended.value.code == 0
    (folder,) = (Path(str(options["out"])) / str(options["model"])).iterdir()
    return folder


@pytest.fixture(scope="session")
def twin_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set of two pairs of worlds, with eight questions."""
    return write_twin_set(tmp_path_factory.mktemp("twins") / "set")


@pytest.fixture(scope="session")
def questions_run(tmp_path_factory: pytest.TempPathFactory, twin_set: Path) -> Path:
    """A run of questions: the baseline `random` on twins, asked twice."""
    output = tmp_path_factory.mktemp("questions")
    return _start(model="random", tasks="nieh_gt", data=twin_set, out=output, repeats=2)


@pytest.fixture(scope="session")
def arm_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of arms that was made by hand: two of three succeed, one fails, one is excluded."""
    records = [
        make_episode_record("a", 3),
        make_episode_record("b", 5, "put", done=False),
        make_episode_record("b", 9, "put"),
        make_episode_record("c", 2, failure="the policy says nan; fix it"),
        make_episode_record("c", 4, excluded="the object is out of reach"),
    ]
    return write_run(make_arm_run("arms", records), tmp_path_factory.mktemp("arms"))


@pytest.fixture
def runs(questions_run: Path, scripted_run: Path, arm_run: Path) -> dict[str, Path]:
    """The folder of a run of each suite."""
    return {"nieh": questions_run, "plans": scripted_run, "manipulation": arm_run}


@pytest.fixture
def export(tmp_path: Path, run_cli: Callable[..., tuple[int, str, str]]) -> Callable[..., Path]:
    """Exports a run; returns the folder of the export."""

    def export(run: Path, file_format: str, *options: object) -> Path:
        out = tmp_path / "exported"
        read_success(run_cli("export", run, "--format", file_format, "--out", out, *options))
        return out

    return export


def primary_metrics(run: Path) -> dict[str, dict[str, float]]:
    """What `results.json` has as each task's primary metric."""
    return json.loads((run / "results.json").read_text())["primary_metrics"]
