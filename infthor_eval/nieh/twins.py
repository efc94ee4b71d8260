"""Paired questions in a set: what each is paired with, and how old their evidence is.

The other question of a pair is about the twin world, or about another moment of the same one.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.grouping import grouped
from infthor_eval.nieh.contexts.base import QuestionVariant
from infthor_eval.nieh.records import TwinSide
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.storage.digests import seed_of

MOMENT = "moment"  # kind of pairs that need no second world


def first_world(traj_ids: Iterable[str]) -> str:
    """Return which of the trajectories of a pair of worlds is asked about first, drawn by both."""
    ordered = sorted(traj_ids)
    return ordered[seed_of("\n".join(ordered)) % len(ordered)]


def is_first(question: Question, other: Question) -> bool:
    """Return True for one question of a pair, drawn by both."""
    if question.traj_id != other.traj_id:
        return question.traj_id == first_world((question.traj_id, other.traj_id))
    return question.id == first_world((question.id, other.id))


def twin_side(task_samples: TaskSamples, sample: QuestionVariant) -> TwinSide | None:
    """Return what a sample's question is paired with; None if it is no twin."""
    if not sample.question.pair:
        return None
    shown = task_samples.positions(sample)
    return _side(task_samples.data, sample.question, shown, task_samples.true_positions(sample))


def twin_of_reply(
    data: NiehSet, question: Question, shown: Sequence[int] | None
) -> TwinSide | None:
    """Return what a question that others asked is paired with; None if it is no twin.

    Args:
        data: its set.
        question: the question.
        shown: positions of the frames that were shown; None if they are not known.
    """
    return _side(data, question, shown, shown) if question.pair else None


def _side(
    data: NiehSet, question: Question, shown: Sequence[int] | None, true: Sequence[int] | None
) -> TwinSide:
    other = paired_with(data, question)
    clues = data.clue_positions(question) if data.has_frames else question.clues
    n_after_clues = None
    if shown is not None and true is not None:
        n_after_clues = sum(position > max(clues) for position in shown)
    side = TwinSide(
        pair=question.pair,
        fact=question.fact,
        kind=MOMENT,
        traj_id=question.traj_id,
        answers=other.answers,
        n_frames=None if shown is None else len(shown),
        n_differing=None,
        n_after_clues=n_after_clues,
    )
    if other.traj_id == question.traj_id and question.moment is not None:
        return _until(side, question.moment, max(question.clues), min(question.clues))
    pair = data.twins.get(question.traj_id)
    if pair is None:
        raise DataError(
            f"{data.root}: twins.jsonl has no pair with {question.traj_id}; make the twins again"
        )
    n_differing = None
    if shown is not None and true is not None:
        n_differing = sum(not pair.frames[at].same for at in true if at < len(pair.frames))
    last = len(pair.frames) - 1 if question.moment is None else question.moment
    side = replace(side, kind=pair.kind, n_differing=n_differing)
    return _until(side, last, pair.evidence(last), min(clues))


def _until(side: TwinSide, last: int, evidence: int | None, oldest: int) -> TwinSide:
    """Return a side with its distances from the frame at which it is asked."""
    return replace(
        side,
        age=None if evidence is None else last - evidence,
        span=max(0, last - oldest),
        length=last + 1,
    )


def paired_with(data: NiehSet, question: Question) -> Question:
    """Return the other question of a pair."""
    others = [it for it in _by_pair(data)[question.pair] if it.id != question.id]
    if len(others) != 1:
        raise DataError(
            f"{data.root}: {len(others)} questions are paired with {question.id} as "
            f"{question.pair!r:.60}, not one; make the twins again"
        )
    return others[0]


@lru_cache(maxsize=8)
def _by_pair(data: NiehSet) -> Mapping[str, Sequence[Question]]:
    return grouped((question.pair, question) for question in data.questions)
