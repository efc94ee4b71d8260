"""How much of the true history a model is given before it acts.

To add a form of `--history`: a class and its name in `history_named`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.household.sequence_text import ACT, action_part, goal_part, plan_part
from infthor_eval.plans.history.past import CountTokens, History, Past
from infthor_eval.plans.history.recalled import MemoryChoice
from infthor_eval.plans.history.retrieved import RetrievedFrames
from infthor_eval.plans.history.segments import Part, PlanSegment, restart_at, segment_parts


class FullHistory(History):
    """The whole history."""

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        return segment_parts(past.all)


class PublishedHistory(History):
    """The whole history as the published loop writes it.

    Three things differ from `FullHistory`: the first action of each past plan stands behind two
    marks, as the plan's own is there already; behind every goal is the first frame of the scene,
    which the loop keeps from its last set-up; plans that belong to no task are left out.
    """

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        parts: list[Part] = []
        for segment in past.all:
            if segment.goal is not None:
                parts += goal_part(segment.goal), past.all[0].before
            if segment.in_task:
                parts += plan_part(segment.plan), *((ACT,) if segment.steps else ())
                for action, frame in segment.steps:
                    parts += action_part(action), frame
        return parts


class GoalHistory(History):
    """The whole history with goals and actions, as in the published chats of branch `dev`.

    Plans begin with a mark and have no text.
    """

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        parts: list[Part] = []
        for segment in past.all:
            if segment.goal is not None:
                parts += goal_part(segment.goal), past.all[0].before
            if segment.steps and segment.in_task:
                parts.append(ACT)
                for action, frame in segment.steps:
                    parts += action_part(action), frame
        return parts


class PlanHistory(History):
    """The plans before in words, as in the published chats of branch `dev`.

    Goal, frames and the plan itself are left out; the present frame follows.
    """

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        plans = [segment.plan for segment in past.segments if segment.in_task]
        text = f"{'; '.join(plans)};" if plans else "No history is available."
        return [f"Action history: {text}\n"]


class LastTokens(History):
    """As many of the last plans as fit, after their goal and the frame that they begin with.

    Whole plans are left out, from the first on, and the goal is repeated if the rest would begin
    without it. So every window has the form of a trajectory's beginning, which is what the models
    were trained on.
    """

    def __init__(self, n_tokens: int) -> None:
        """Set the maximum tokens before the first action; the plan's own steps come on top."""
        self._n_tokens = n_tokens

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`; by bisection, as each count encodes the window."""
        segments = past.all
        # Numbers of last segments.
        least = 1
        most = len(segments)
        if not self._fits(segments, least, count):
            raise ModelError(
                f"the plan alone takes more than {self._n_tokens} tokens; give --history last:N a "
                "larger N"
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
            raise ModelError(
                "the model counts no tokens, so --history last:N cannot be used; use full"
            )
        return n_tokens <= self._n_tokens


def _window(segments: Sequence[PlanSegment], n_last: int) -> list[Part]:
    return segment_parts(restart_at(segments, len(segments) - n_last))


class StateInWords(History):
    """The present frame, and what was seen before it in words, as in the published text state."""

    needs_state: ClassVar[bool] = True

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        text = f" State: {past.state}; Last agent's view: "
        return [goal_part(past.goal) + text, past.present.before, plan_part(past.present.plan)]


def history_named(text: str, memory: MemoryChoice) -> History:
    """Return the history of a value of `--history`.

    Args:
        text: "full", "published", "goals", "plans", "last:N" (N tokens), "text", "retrieved:K" or
            "frames:K" (K frames), or "memory".
        memory: the options of memories.
    """
    kind, _, number = text.partition(":")
    size = int(number) if number.isdecimal() else 0
    if text == "memory":
        return memory.open()
    memory.refuse(text)
    if kind == "frames" and size:
        # Where the trajectories have no frames of their own for `retrieved:K`.
        return MemoryChoice("clip-view", f"k={size}", None, memory.retriever, memory.blank).open()
    if memory.retriever is not None:
        raise UsageError(
            f"--retriever: --history {text} retrieves no frames; leave it out, or use --history "
            "frames:K"
        )
    if kind in _SIZED and size:
        return _SIZED[kind](size)
    if text in _WHOLE:
        return _WHOLE[text]()
    raise UsageError(f"--history {text}: there are {_ALL}")


_ALL = "full, published, last:TOKENS, text, retrieved:K, frames:K, memory, goals and plans"
_WHOLE: Mapping[str, Callable[[], History]] = {
    "full": FullHistory,
    "goals": GoalHistory,
    "plans": PlanHistory,
    "published": PublishedHistory,
    "text": StateInWords,
}
_SIZED: Mapping[str, Callable[[int], History]] = {"last": LastTokens, "retrieved": RetrievedFrames}
