"""Units of a run: one question in one context, with all that its reply depends on."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.prompts import question_text
from infthor_eval.runs.identity import fingerprint

__all__ = ["Unit", "by_shared_frames"]


@dataclass(frozen=True)
class Unit:
    """A question, the frames it is asked on, and how the reply is decoded.

    Attributes:
        task: the lm-eval task that asks.
        question: the question with its gold answers.
        frames: the context, in order.
        decoding: lm-eval's generation settings (`max_gen_toks`, `until`, ...).
    """

    task: str
    question: Question
    frames: tuple[FrameRef, ...]
    decoding: Mapping[str, Any]

    @property
    def text(self) -> str:
        """What follows the frames."""
        return question_text(self.question)

    @cached_property
    def fingerprint(self) -> str:
        """Hash of the inputs: text, content of the frames, gold answers, decoding.

        Raises:
            DataError: a frame cannot be read.
        """
        return fingerprint(
            {
                "text": self.text,
                "frames": [frame.digest for frame in self.frames],
                "answers": list(self.question.answers),
                "decoding": dict(self.decoding),
            }
        )


def by_shared_frames(units: Iterable[Unit]) -> list[list[Unit]]:
    """Units in the order of work: those on the same frames together, those of one trajectory after another.

    Neighbours then share as long a prefix of frames as there is, which a model's conversation encodes once. The
    order depends on the units alone, so it is the same when a run is resumed.
    """
    ordered = sorted(units, key=lambda unit: (unit.task, unit.question.traj_id))
    groups: list[list[Unit]] = []
    for _, of_trajectory in groupby(ordered, key=lambda unit: (unit.task, unit.question.traj_id)):
        # One trajectory at a time: names of all frames of all units at once would not fit in memory.
        named = sorted(of_trajectory, key=_frame_names)
        groups += [list(group) for _, group in groupby(named, key=_frame_names)]
    return groups


def _frame_names(unit: Unit) -> list[str]:
    return [frame.path.name for frame in unit.frames]
