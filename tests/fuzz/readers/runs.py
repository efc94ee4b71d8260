"""Runs: their journals, results and commands, by what lists, shows and reports them."""

import contextlib
import io
import json
import shutil
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import yaml

from infthor_eval.cli import main
from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.cli.progress.notes import print_failure
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.report.live.state import LiveRun
from infthor_eval.run import Run, find_runs, open_runs

from ...helpers.arm_runs import make_arm_run, make_episode_record
from ...helpers.command_line import option_words
from ...helpers.journals import write_run
from ..damage import Form
from ..reader import Reader
from .samples import make_set, trajectory_document

__all__ = ["READERS"]


@cache
def _run(model: str, task: str = "nieh_gt", *more: str) -> Path:
    """Return the folder of a run of a baseline on the small set, or on its trajectories; made
    once."""
    scratch = TemporaryDirectory()
    _kept.append(scratch)
    root = Path(scratch.name)
    words = option_words(
        model=model, tasks=task, data=str(make_set(root / "set")), out=str(root / "out")
    )
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
        main([*words, *more])
    (folder,) = (root / "out" / model).iterdir()
    return folder


_kept: list[TemporaryDirectory[str]] = []


def _make(pattern: str, folder: Path) -> Path:
    """Copy two runs, and return the file of one of them that a pattern names."""
    for name, model in (("damaged", "oracle"), ("sound", "blind")):
        shutil.copytree(_run(model), folder / name)
    (file,) = (folder / "damaged").glob(pattern)
    if file.suffix == ".yaml":
        file.write_text(json.dumps(yaml.safe_load(file.read_text())))
    return file


def _make_plans(folder: Path) -> Path:
    """Copy two runs of plans, and return the journal of one of them."""
    for name, model in (("damaged", "scripted"), ("sound", "random")):
        shutil.copytree(_run(model, "infthor_plans"), folder / name)
    (file,) = (folder / "damaged").glob("journal/*.jsonl")
    return file


def _make_memory(folder: Path) -> Path:
    """Copy two runs behind a memory, and return the journal of one of them."""
    for name, model in (("damaged", "oracle"), ("sound", "blind")):
        more = ("--memory", "last", "--budget", "300", "--tokens-per-frame", "100")
        shutil.copytree(_run(model, "nieh_memory", *more), folder / name)
    (file,) = (folder / "damaged").glob("journal/*.jsonl")
    return file


def _make_arms(folder: Path) -> Path:
    """Write two runs of arms, and return the journal of one of them."""
    for name in ("damaged", "sound"):
        records = [make_episode_record(f"t{n}", n, done=bool(n % 2)) for n in range(4)]
        write_run(make_arm_run(name, records), folder / "made", name)
        shutil.move(folder / "made" / name / name, folder / name)
    shutil.rmtree(folder / "made")
    (file,) = (folder / "damaged").glob("journal/*.jsonl")
    return file


def _rescore(folder: Path) -> None:
    source = read_source(Run.open(folder / "damaged"))
    assert all(record.task for record in source.records)


def _watch(folder: Path) -> None:
    LiveRun(folder / "damaged").state()


def _find(folder: Path) -> None:
    runs = list(find_runs(folder))
    assert any(isinstance(run, Run) and run.folder.name == "sound" for run in runs), (
        "the good run is not listed"
    )


def _show(folder: Path) -> None:
    Run.open(folder / "damaged", print_failure).read()


def _report(folder: Path) -> None:
    runs = open_runs([folder / "damaged", folder / "sound"])
    presenter = runs[0].presenter
    list(presenter.sections(runs))
    list(presenter.charts(runs))
    for record in runs[0].records:
        (
            presenter.describe(record),
            presenter.details(record),
            presenter.reply(record),
            list(presenter.steps(record)),
        )


def _make_replayed(folder: Path) -> Path:
    """Write a trajectory, and the report of its replay as if it had been replayed."""
    (folder / "a.json").write_text(json.dumps(trajectory_document("t")))
    report = folder / "set/metadata/t/replay.json"
    report.parent.mkdir(parents=True)
    refusal = {"step": 0, "action": "pick up the mug", "error": "no"}
    overlap = {"step": 0, "action": "PickupObject", "type": "Mug", "iou": 0.5}
    document = {
        "traj_id": "t",
        "digest": "x",
        "floor_plan": "bedroom-1",
        "accepted": {"MoveAhead": 1},
    }
    report.write_text(json.dumps(document | {"refusals": [refusal], "overlaps": [overlap]}))
    return report


def _continue(folder: Path) -> None:
    simulator: Any = SimpleNamespace(label="embedded", frames=None)
    replay_set(select([folder / "a.json"]), simulator, folder / "set")


READERS = (
    Reader("journal, listed", Form.JSON_LINES, partial(_make, "journal/*.jsonl"), _find),
    Reader("journal, shown", Form.JSON_LINES, partial(_make, "journal/*.jsonl"), _show),
    Reader("journal, reported", Form.JSON_LINES, partial(_make, "journal/*.jsonl"), _report),
    Reader("journal of plans, shown", Form.JSON_LINES, _make_plans, _show),
    Reader("journal of plans, reported", Form.JSON_LINES, _make_plans, _report),
    Reader("journal of arms, shown", Form.JSON_LINES, _make_arms, _show),
    Reader("journal of arms, reported", Form.JSON_LINES, _make_arms, _report),
    Reader("journal behind a memory, shown", Form.JSON_LINES, _make_memory, _show),
    Reader("journal behind a memory, reported", Form.JSON_LINES, _make_memory, _report),
    Reader("journal, rescored", Form.JSON_LINES, partial(_make, "journal/*.jsonl"), _rescore),
    Reader("journal, watched", Form.JSON_LINES, partial(_make, "journal/*.jsonl"), _watch),
    Reader("results, listed", Form.JSON, partial(_make, "results.json"), _find),
    Reader("results, shown", Form.JSON, partial(_make, "results.json"), _show),
    Reader("stored command", Form.JSON, partial(_make, "run.yaml"), _report),
    Reader("replay report", Form.JSON, _make_replayed, _continue),
)
