"""Kinds of runs: what each needs, and its command. All are as small as they can be."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fault_explorer.forks import Place

__all__ = ["KINDS", "Kind", "Words"]

Words = tuple[str | Path, ...]


@dataclass(frozen=True)
class Kind:
    """A kind of run.

    Attributes:
        name: its name in the table.
        words: the command, given the place.
        inputs: commands that make its inputs first; they write into the place's `inputs`.
        start: folder within `inputs` that is there, in `out`, before the command; None for none.
    """

    name: str
    words: Callable[[Place], Words]
    inputs: Callable[[Place], tuple[Words, ...]] = lambda _: ()
    start: str | None = None


def _generate(place: Place) -> Words:
    words: Words = ("generate", "--scene", "kitchen-1", "--min-steps", "1", "--min-subgoals", "1")
    return (*words, "--out", place.inputs / "trajectories")


def _replay(place: Place) -> Words:
    return ("replay", place.inputs / "trajectories", "--out", place.inputs / "set")


_RUN: Words = ("run", "--quiet", "--output")

KINDS = (
    Kind(
        "questions",
        lambda place: (*_RUN, place.out / "runs", "--model", "qwen2.5-vl-tiny", "--tasks", "nieh_mini_gt", "--limit", "2"),
    ),
)
