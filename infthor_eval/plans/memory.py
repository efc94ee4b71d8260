"""How much of the true history a model is given before it acts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT, action_part, goal_part, plan_part
from infthor_eval.plans.segments import Part, PlanSegment, goal_of_last, restart_at, segment_parts

__all__ = [
    "CountTokens",
    "FullHistory",
    "LastTokens",
    "Memory",
    "Past",
    "PublishedHistory",
    "StateInWords",
    "TopFrames",
    "memory_named",
]

CountTokens = Callable[[Sequence[Part]], int | None]
_RETRIEVER = "openai/clip-vit-large-patch14"  # as published for questions


@dataclass(frozen=True)
class Past:
    """The history before a plan.

    Attributes:
        segments: segments of the plans before.
        present: the plan's own segment, without a step.
        state: the state of room and agent in words, as far as it was seen; empty if no memory needs it.
    """

    segments: Sequence[PlanSegment]
    present: PlanSegment
    state: str = ""

    @property
    def all(self) -> list[PlanSegment]:
        """All segments, the present one last."""
        return [*self.segments, self.present]

    @property
    def goal(self) -> str:
        """The goal that the plan belongs to."""
        return goal_of_last(self.all)

    @property
    def frames(self) -> list[FrameRef]:
        """Every frame before the present one."""
        after = [frame for segment in self.segments for _, frame in segment.steps]
        return [segment.before for segment in self.all[:1] if after] + after[:-1]


class Memory(Protocol):
    """Selects what a model is given; `needs_state` tells whether it needs the state in words."""

    needs_state: ClassVar[bool]

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what the model is given before the first action of a plan.

        Args:
            count: counts the tokens of some parts; returns None if the model does not count.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the required parts do not fit.
        """


class FullHistory:
    """The whole history."""

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `Memory`."""
        return segment_parts(past.all)


class PublishedHistory:
    """The whole history as the published loop writes it.

    Three things differ from `FullHistory`: the first action of each past plan stands behind two marks, as the plan's
    own is there already; behind every goal is the first frame of the scene, which the loop keeps from its last set-up;
    plans that belong to no task are left out.
    """

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `Memory`."""
        parts: list[Part] = []
        for segment in past.all:
            if segment.goal is not None:
                parts += goal_part(segment.goal), past.all[0].before
            if segment.in_task:
                parts += plan_part(segment.plan), *((ACT,) if segment.steps else ())
                parts += (part for action, frame in segment.steps for part in (action_part(action), frame))
        return parts


class LastTokens:
    """As many of the last plans as fit, after the goal that they belong to and the frame that they begin with.

    Whole plans are left out, from the first on, and the goal is repeated if the rest would begin without it. So every
    window has the form of a trajectory's beginning, which is what the models were trained on.
    """

    needs_state: ClassVar[bool] = False

    def __init__(self, n_tokens: int) -> None:
        """Set the maximum number of tokens before the model's first action; the plan's own steps come on top."""
        self._n_tokens = n_tokens

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `Memory`; by bisection, as each count encodes the window."""
        segments = past.all
        least, most = 1, len(segments)  # number of last segments
        if not self._fits(segments, least, count):
            raise ModelError(
                f"the plan alone takes more than {self._n_tokens} tokens; give --history last:N a larger N"
            )
        while least < most:
            middle = (least + most + 1) // 2
            if self._fits(segments, middle, count):
                least = middle
            else:
                most = middle - 1
        return _window(segments, least)

    def _fits(self, segments: Sequence[PlanSegment], n_last: int, count: CountTokens) -> bool:
        n_tokens = count(_window(segments, n_last))
        if n_tokens is None:
            raise ModelError("the model counts no tokens, so --history last:N cannot be used; use full")
        return n_tokens <= self._n_tokens


def _window(segments: Sequence[PlanSegment], n_last: int) -> list[Part]:
    return segment_parts(restart_at(segments, len(segments) - n_last))


class StateInWords:
    """The present frame, and what was seen before it in words, as in the published text state."""

    needs_state: ClassVar[bool] = True

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `Memory`."""
        text = f" State: {past.state}; Last agent's view: "
        return [goal_part(past.goal) + text, past.present.before, plan_part(past.present.plan)]


class TopFrames:
    """The earlier frames that are most similar to the present one, in time order, and that one."""

    needs_state: ClassVar[bool] = False

    def __init__(self, n_frames: int, retriever: str) -> None:
        """Load a CLIP model, a hub id or a folder, to show some frames (the paper: 20) beside the present one.

        Raises:
            UsageError: there is no such model.
        """
        from model_adapters.hf.retrieval import open_retriever

        self._n_frames, self._retriever = n_frames, open_retriever(retriever, None)

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `Memory`."""
        return [*self.choose(past), goal_part(past.goal), past.present.before, plan_part(past.present.plan)]

    def choose(self, past: Past) -> list[FrameRef]:
        """Return the chosen frames; raises DataError if one cannot be read."""
        from model_adapters.hf.vectors import nearest

        if not past.frames:
            return []
        vectors = self._retriever.frames([*past.frames, past.present.before])
        return [past.frames[number] for number in nearest(vectors[:-1], vectors[-1], self._n_frames)]


def memory_named(text: str, retriever: str | None = None) -> Memory:
    """Return the memory of a value of `--history`; `retriever` is a CLIP model, None the published one.

    Args:
        text: "full", "published", "last:N" (N tokens), "text", or "frames:K" (K frames).

    Raises:
        UsageError: there is no such memory, or a retriever is given that it does not use.
    """
    kind, _, number = text.partition(":")
    size = int(number) if number.isdecimal() else 0
    if kind == "frames" and size:
        return TopFrames(size, retriever or _RETRIEVER)
    if retriever is not None:
        raise UsageError(f"--retriever: --history {text} retrieves no frames; leave it out, or use --history frames:K")
    if text == "full":
        return FullHistory()
    if text == "published":
        return PublishedHistory()
    if text == "text":
        return StateInWords()
    if kind == "last" and size:
        return LastTokens(size)
    raise UsageError(f"--history {text}: there are full, published, last:TOKENS, text and frames:K")
