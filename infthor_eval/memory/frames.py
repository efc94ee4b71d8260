"""Memories that recall frames, by their place in the trajectory alone."""

import random
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from infthor_eval.memory.protocol import MemoryCapabilities, Query, Recalled
from infthor_eval.memory.steps import StepMemory

PUBLISHED_K = 10  # frames that the published retrieval shows


class FrameMemory(StepMemory, ABC):
    """Base of memories that keep all frames and choose some; a class says which."""

    def __init__(self, k: int = PUBLISHED_K) -> None:
        """Set the number of frames to recall where there is no budget of tokens."""
        if k < 1:
            raise ValueError(f"k is {k}; it is a number of frames from 1")
        super().__init__()
        self._k = k

    def recall(self, query: Query, budget: int | None) -> Recalled:
        """See `Memory`; in time order."""
        n_frames = min(self._room(budget), len(self.past))
        return [self.past[index] for index in sorted(self.choose(query, n_frames))]

    @abstractmethod
    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """Return the places of at most so many frames in `past`, which has as many."""

    def _room(self, budget: int | None) -> int:
        if budget is None or self.facts.tokens_per_frame is None:
            return self._k
        return budget // self.facts.tokens_per_frame

    def draw(self, query: Query) -> random.Random:
        """Return a generator for a query, the same one each time it is asked."""
        return random.Random(f"{self.facts.seed}/{self.facts.name}/{query.text}/{len(self.past)}")


class Nothing(FrameMemory):
    """No memory: the current view alone, which every memory must be better than."""

    def __init__(self) -> None:
        """There is nothing to set."""
        super().__init__()

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`."""
        return ()


class Last(FrameMemory):
    """The last frames before the current view: recency alone, a window of so many tokens."""

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`."""
        return range(len(self.past) - n_frames, len(self.past))


class Uniform(FrameMemory):
    """Frames at even distances over the whole trajectory, the first among them."""

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`."""
        return [number * len(self.past) // n_frames for number in range(n_frames)]


class Random(FrameMemory):
    """Frames drawn for each question: the floor that choosing must rise above."""

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`."""
        return self.draw(query).sample(range(len(self.past)), n_frames)


class Oracle(FrameMemory):
    """The clue frames, and others drawn until as many as of other memories: the upper bound.

    Of more clues than there is room for, those at even distances among them are shown. A question
    without evidence (an absence) has drawn frames alone.
    """

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(privileged=True)

    def choose(self, query: Query, n_frames: int) -> Sequence[int]:
        """See `FrameMemory`."""
        known = set(query.clues or ())
        clues = [
            index for index, observation in enumerate(self.past) if observation.number in known
        ]
        if len(clues) >= n_frames:
            return [clues[number * len(clues) // n_frames] for number in range(n_frames)]
        others = [
            index for index, observation in enumerate(self.past) if observation.number not in known
        ]
        return [*clues, *self.draw(query).sample(others, n_frames - len(clues))]
