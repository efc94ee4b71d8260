"""What a replay shows of an episode, as plain values: no simulator is needed to draw it."""

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")
V = TypeVar("V")


@dataclass(frozen=True, kw_only=True)
class EpisodeFrame(Generic[T, V]):
    """The start of an episode, or the result of a step.

    Attributes:
        title: what the episode asks for.
        observation: the world at that time; None if nobody acted in the episode.
        number: number of the step, from 1 on; 0 at the start.
        ending: how the episode ended with the step; empty if it goes on.
        done: whether it ended as a success.
        note: how the replay differs from the record; empty if it does not.
    """

    title: T
    observation: V | None
    number: int = 0
    ending: str = ""
    done: bool = False
    note: str = ""
