"""NIEH sets: their files, by every context that needs no model of its own, and by the rules of
questions."""

from functools import partial
from pathlib import Path

from infthor_eval.errors import InfthorError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.generation.questions.generate import generate_questions
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.samples import find_samples, open_set
from infthor_eval.nieh.validation import read_decisions

from ..damage import Form
from ..reader import Reader
from .samples import GOOD, make_set

__all__ = ["READERS"]

_SETTINGS = {"tokens_per_frame": 100, "ctx_size": 0.3, "seed": 0}
_CONTEXTS = (
    "clues",
    "trajectory",
    "truncate_head",
    "haystack",
    "interleaved",
    "interleaved_plans",
    "text_state",
)


def _make(file: str, folder: Path, n_frames: int = 4) -> Path:
    return make_set(folder, n_frames) / file


def _ask(folder: Path) -> None:
    """Prepare every question in every context."""
    good = [question for question in NiehSet(folder).questions if question.traj_id == GOOD]
    assert len(good) == 2, f"{len(good)} of 2 good questions come"
    for context in _CONTEXTS:
        open_set.cache_clear()
        task_samples = find_samples({"context": context, "data": str(folder), **_SETTINGS})
        n_good = 0
        for sample in task_samples.samples:
            is_good = sample.question.traj_id == GOOD
            try:
                task_samples.request(sample)
            except InfthorError:
                assert not is_good, f"{context}: a good question is refused"
            n_good += is_good
        assert n_good >= 2, f"{context}: {n_good} good samples"


def _recall(folder: Path) -> None:
    for memory in ("last", "text-log", "oracle"):
        open_set.cache_clear()
        task_samples = find_samples(
            {"context": "memory", "memory": memory, "budget": 200, "data": str(folder), **_SETTINGS}
        )
        for sample in recall_all(task_samples):
            task_samples.request(sample)


def _generate(folder: Path) -> None:
    generated = generate_questions(folder, seed=0, per_trajectory=20, further=True)
    assert any(question.traj_id == GOOD for question in generated.questions), (
        "no question on the good one"
    )


def _questions(folder: Path) -> None:
    data = NiehSet(folder)
    assert len({question.id for question in data.questions}) == len(data.questions)
    assert all(item.reason for item in data.skipped)


def _make_decisions(folder: Path) -> Path:
    path = folder / "inspection.csv"
    path.write_text(
        "question_id,traj_id,question,clues,answers,replies,decision\n"
        "a,t,q,[1],['b'],m: x,keep\n"
        "b,,,,,,\n"
    )
    return path


_BAD = "metadata/bad"
READERS = (
    Reader("question file", Form.CSV, partial(_make, "qa_set.csv"), _questions),
    Reader("set step log", Form.JSON, partial(_make, f"{_BAD}/metadata.json"), _ask),
    Reader("set trajectory", Form.JSON, partial(_make, f"{_BAD}/traj_data.json"), _ask),
    Reader("set action log", Form.JSON, partial(_make, f"{_BAD}/expert_log.json"), _ask),
    Reader("set states", Form.JSON, partial(_make, f"{_BAD}/state_summary.json"), _ask),
    Reader("set text", Form.TEXT, partial(_make, f"{_BAD}/traj.txt"), _ask),
    Reader(
        "set info", Form.JSON, partial(_make, "set.json"), lambda folder: NiehSet(folder).questions
    ),
    Reader("memory step log", Form.JSON, partial(_make, f"{_BAD}/metadata.json"), _recall),
    Reader(
        "generated questions",
        Form.JSON,
        partial(_make, f"{_BAD}/metadata.json", n_frames=24),
        _generate,
    ),
    Reader(
        "decisions",
        Form.CSV,
        _make_decisions,
        lambda folder: read_decisions(folder / "inspection.csv"),
    ),
)
