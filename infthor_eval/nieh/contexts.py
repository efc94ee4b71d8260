"""Contexts: which frames of its trajectory a question is asked on."""

from collections.abc import Callable

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question

__all__ = ["CONTEXTS", "Context", "context_named"]

Context = Callable[[NiehSet, Question], tuple[FrameRef, ...]]


def _clues(data: NiehSet, question: Question) -> tuple[FrameRef, ...]:
    """The frames that hold the evidence and no others (the paper's Table 4)."""
    return data.clue_frames(question)


def _trajectory(data: NiehSet, question: Question) -> tuple[FrameRef, ...]:
    """Every frame of the trajectory (the published `full_traj`)."""
    return data.frames(question.traj_id)


CONTEXTS: dict[str, Context] = {"clues": _clues, "trajectory": _trajectory}


def context_named(name: str) -> Context:
    """The context of that name.

    Raises:
        UsageError: there is none.
    """
    if name not in CONTEXTS:
        raise UsageError(f"unknown context {name!r}; a task's dataset_kwargs takes {', '.join(CONTEXTS)}")
    return CONTEXTS[name]
