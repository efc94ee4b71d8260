"""The true history of a trajectory in the words that agents are trained on, plan by plan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import action_part, goal_part, plan_part

__all__ = ["Chapter", "Part", "chapter_parts", "goal_before", "opened"]

Part = str | FrameRef


@dataclass(frozen=True)
class Chapter:
    """One plan's share of the sequence.

    Attributes:
        plan: its text.
        goal: of the task that begins with it; None where the task before goes on.
        before: the frame that it begins with.
        steps: actions, each with the frame after it; empty while the plan is still to be done.
    """

    plan: str
    goal: str | None
    before: FrameRef
    steps: tuple[tuple[str, FrameRef], ...] = ()

    def opening(self) -> Iterator[Part]:
        """What stands before its first action."""
        if self.goal is not None:
            yield goal_part(self.goal)
            yield self.before
        yield plan_part(self.plan)

    def parts(self) -> Iterator[Part]:
        """All of it."""
        yield from self.opening()
        for action, frame in self.steps:
            yield action_part(action)
            yield frame


def chapter_parts(chapters: Sequence[Chapter]) -> list[Part]:
    """The parts of chapters that follow each other."""
    return [part for chapter in chapters for part in chapter.parts()]


def goal_before(chapters: Sequence[Chapter]) -> str:
    """The goal that the last of some chapters serves."""
    return next(chapter.goal for chapter in reversed(chapters) if chapter.goal is not None)


def opened(chapters: Sequence[Chapter], first: int, end: int | None = None) -> list[Chapter]:
    """Some chapters of a history in the form of its beginning: the first of them says its goal and shows its frame.

    Args:
        chapters: the history from its beginning on.
        first: of those that are wanted.
        end: the one behind the last; None takes all that follow.
    """
    opening = replace(chapters[first], goal=goal_before(chapters[: first + 1]))
    return [opening, *chapters[first + 1 : end]]
