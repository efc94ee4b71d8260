"""Kinds of runs: what each needs, and its command. All are as small as they can be."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fault_explorer.forks import Place
from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question import Question

__all__ = ["KINDS", "Kind", "Words"]

Words = tuple[str | Path, ...]

_SET = Path("infthor_eval", "sets", "nieh_mini")
_N_REPLIES = 3


@dataclass(frozen=True)
class Kind:
    """A kind of run.

    Attributes:
        name: its name in the table.
        words: the command, given the place.
        inputs: commands that make its inputs first, in the place's `inputs`.
        files: writes files there before.
        start: folder there that is copied to `out` before each run; None for none.
        simulates: whether it starts simulators.
    """

    name: str
    words: Callable[[Place], Words]
    inputs: Callable[[Place], tuple[Words, ...]] = lambda _: ()
    files: Callable[[Path], None] = lambda _: None
    start: str | None = None
    simulates: bool = False


def _run(place: Place, model: str, task: str, *more: str | Path) -> Words:
    command = ("run", "--quiet", "--out", place.out / "runs", "--model", model)
    return (*command, "--tasks", task, *more)


def _generate(folder: Path) -> Words:
    command = ("generate", "--scene", "bathroom-3", "--min-steps", "1", "--min-subgoals", "1")
    return (*command, "--out", folder / "trajectories")


def _trajectory(place: Place) -> tuple[Words, ...]:
    return (_generate(place.inputs),)


def _replay(place: Place, folder: Path) -> Words:
    return ("replay", place.inputs / "trajectories", "--out", folder / "set")


def _replayed(place: Place) -> tuple[Words, ...]:
    return (*_trajectory(place), _replay(place, place.inputs))


def _questioned(place: Place) -> tuple[Words, ...]:
    folder = place.inputs / "set"
    command = ("questions", folder, "--per-trajectory", "4", "--out", folder / "qa_set_new.csv")
    return (*_replayed(place), command)


def _twins(place: Place, *more: str) -> Words:
    command = ("twins", place.inputs / "trajectories", "--out", place.out / "twins")
    return (*command, "--kinds", "move", "--per-kind", "1", *more)


def _write_replies(folder: Path) -> None:
    """Write a log of replies to questions of the bundled set."""
    questions = read_questions(next(_bundled_set().glob("qa_set*.csv")))
    ids = [row.id for row in questions if isinstance(row, Question)][:_N_REPLIES]
    rows = [json.dumps({"question_id": name, "reply": "yes"}) for name in ids]
    (folder / "replies.jsonl").write_text("\n".join(rows) + "\n")


def _write_manifest(folder: Path) -> None:
    """Write the manifest of a set of one trajectory."""
    trajectory = {"scene": "bathroom-3", "seed": 0, "min_steps": 1}
    manifest = {"name": "small", "trajectories": [trajectory], "per_trajectory": 2}
    (folder / "manifest.json").write_text(json.dumps(manifest))


def _bundled_set() -> Path:
    return Path(__file__).parents[2] / _SET


def _asked(place: Place) -> tuple[Words, ...]:
    command = ("run", "--quiet", "--out", place.inputs, "--model", "oracle")
    return ((*command, "--tasks", "nieh_mini_gt", "--limit", "2"),)


def _report(place: Place) -> Words:
    runs = sorted((place.inputs / "oracle").iterdir())
    return ("report", *runs, "--out", place.out / "report.html")


def _exported(form: str) -> Kind:
    def words(place: Place) -> Words:
        runs = sorted((place.inputs / "oracle").iterdir())
        return ("export", *runs, "--format", form, "--out", place.out / "exported")

    return Kind(f"export {form}", words, _asked)


def _train(place: Place) -> Words:
    command = ("train", "--recipe", "questions", "--model", "qwen2.5-vl-tiny", "--data")
    steps = ("--set", "max_steps=2", "--set", "save_every=1")
    return (*command, place.inputs / "set", *steps, "--out", place.out / "training")


KINDS = (
    Kind("questions", lambda place: _run(place, "oracle", "nieh_mini_gt", "--limit", "2")),
    Kind(
        "questions by a model",
        lambda place: _run(place, "qwen2.5-vl-tiny", "nieh_mini_gt", "--limit", "2"),
    ),
    Kind(
        "plans",
        lambda place: _run(
            place, "scripted", "infthor_plans", "--data", place.inputs / "trajectories"
        ),
        _trajectory,
        simulates=True,
    ),
    Kind(
        "arms",
        lambda place: _run(
            place, "planner-arm", "manipulathor_pickup", "--data", place.inputs / "trajectories"
        ),
        _trajectory,
        simulates=True,
    ),
    Kind("generate", lambda place: _generate(place.out), simulates=True),
    Kind("replay", lambda place: _replay(place, place.out), _trajectory, simulates=True),
    Kind(
        "making questions",
        lambda place: ("questions", place.out, "--out", place.out / "qa_set_new.csv"),
        _replayed,
        start="set",
        simulates=True,
    ),
    Kind("twins", _twins, _trajectory, simulates=True),
    Kind("final twins", lambda place: _twins(place, "--final-tasks"), _trajectory, simulates=True),
    Kind(
        "import-replies",
        lambda place: (
            *("import-replies", place.inputs / "replies.jsonl", "--data", _bundled_set()),
            *("--model", "theirs", "--out", place.out / "runs"),
        ),
        files=_write_replies,
    ),
    Kind("report", _report, _asked),
    Kind(
        "rescore",
        lambda place: (
            *("rescore", *sorted((place.inputs / "oracle").iterdir())),
            *("--out", place.out / "runs"),
        ),
        _asked,
    ),
    *map(_exported, ("every-eval-ever", "inspect", "lm-eval")),
    Kind(
        "bundle",
        lambda place: ("bundle", place.inputs / "manifest.json", "--out", place.out / "bundle"),
        files=_write_manifest,
        simulates=True,
    ),
    Kind("train", _train, _questioned, simulates=True),
)
