"""Units of a run: one question asked in one way, with all that its reply depends on."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

from infthor_eval.formats.digests import fingerprint
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Part
from infthor_eval.nieh.notes import Notes

__all__ = ["Unit", "by_shared_context"]


@dataclass(frozen=True)
class Unit:
    """A question, the context it is asked in, and how the reply is decoded.

    Attributes:
        task: the lm-eval task that asks.
        question: the question with its gold answers.
        variant: which of the task's ways of asking this is; empty where there is one.
        context: what the model is shown before the question's text; notes in it are taken before the unit is asked.
        text: the text with the question.
        decoding: lm-eval's generation settings (`max_gen_toks`, `until`, ...).
    """

    task: str
    question: Question
    variant: str
    context: tuple[Part, ...]
    text: str
    decoding: Mapping[str, Any]

    @property
    def key(self) -> tuple[str, str, str]:
        """Which unit of the run this is."""
        return self.task, self.question.id, self.variant

    @property
    def shown(self) -> tuple[str | FrameRef, ...]:
        """The context as the model is shown it, once its notes are taken."""
        shown = tuple(part for part in self.context if not isinstance(part, Notes))
        if len(shown) < len(self.context):
            raise ValueError("the context holds notes that are not taken yet")
        return shown

    @cached_property
    def fingerprint(self) -> str:
        """Hash of the inputs: context with the frames' content, text, gold answers, decoding.

        Raises:
            DataError: a frame cannot be read.
        """
        return fingerprint(
            {
                "context": [[part.digest] if isinstance(part, FrameRef) else part for part in self.shown],
                "text": self.text,
                "answers": list(self.question.answers),
                "decoding": dict(self.decoding),
            }
        )


def by_shared_context(units: Iterable[Unit]) -> list[list[Unit]]:
    """Units in the order of work: those in the same context together, those of one trajectory after another.

    Neighbours then share as long a prefix as there is, which a model's conversation encodes once. The order depends on
    the units alone, so it is the same when a run is resumed.
    """
    ordered = sorted(units, key=lambda unit: (unit.task, unit.question.traj_id))
    groups: list[list[Unit]] = []
    for _, of_trajectory in groupby(ordered, key=lambda unit: (unit.task, unit.question.traj_id)):
        # One trajectory at a time: names of all frames of all units at once would not fit in memory.
        named = sorted(of_trajectory, key=_names)
        groups += [list(group) for _, group in groupby(named, key=_names)]
    return groups


def _names(unit: Unit) -> list[str]:
    return [name for part in unit.context for name in _names_in(part)]


def _names_in(part: Part) -> list[str]:
    if isinstance(part, Notes):
        return [f"notes of {part.taking}", *(frame.path.name for frame in part.frames)]
    return [part.path.name if isinstance(part, FrameRef) else part]
