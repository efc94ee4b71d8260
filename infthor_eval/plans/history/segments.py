"""The true history of a trajectory in the words that agents are trained on, plan by plan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import action_part, goal_part, plan_part

Part = str | FrameRef


@dataclass(frozen=True)
class PlanSegment:
    """One plan's segment of the sequence.

    Attributes:
        plan: text of the plan.
        goal: goal of the task that begins with it; None if the task before goes on.
        before: frame that it begins with.
        steps: actions, each with the frame after it; empty if the plan is still to be done.
        in_task: whether the plan belongs to a task.
    """

    plan: str
    goal: str | None
    before: FrameRef
    steps: tuple[tuple[str, FrameRef], ...] = ()
    in_task: bool = True

    def opening(self) -> Iterator[Part]:
        """Yield the parts before its first action."""
        if self.goal is not None:
            yield goal_part(self.goal)
            yield self.before
        yield plan_part(self.plan)

    def parts(self) -> Iterator[Part]:
        """Yield all parts."""
        yield from self.opening()
        for action, frame in self.steps:
            yield action_part(action)
            yield frame


def segment_parts(segments: Sequence[PlanSegment]) -> list[Part]:
    """Return the parts of consecutive segments."""
    return [part for segment in segments for part in segment.parts()]


def goal_of_last(segments: Sequence[PlanSegment]) -> str:
    """Return the goal that the last of some segments belongs to."""
    return next(segment.goal for segment in reversed(segments) if segment.goal is not None)


def restart_at(
    segments: Sequence[PlanSegment], first: int, end: int | None = None
) -> list[PlanSegment]:
    """Return `segments[first:end]` as a history begins: the first one has goal and frame."""
    opening = replace(segments[first], goal=goal_of_last(segments[: first + 1]))
    return [opening, *segments[first + 1 : end]]
