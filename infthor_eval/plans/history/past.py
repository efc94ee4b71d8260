"""The true history before a plan, and the protocol of what selects from it."""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.sequence_text import goal_part, plan_part
from infthor_eval.memory import Observation
from infthor_eval.plans.history.segments import Part, PlanSegment, goal_of_last

CountTokens = Callable[[Sequence[Part]], int | None]


@dataclass(frozen=True)
class Past:
    """The history before a plan.

    Attributes:
        segments: segments of the plans before.
        present: the plan's own segment, without a step.
        state: the state of room and agent in words, as far as it was seen; empty if no history
            needs it.
        logs: what each frame up to the present one shows, for memories that are given it; empty if
            it is not known.
        clue: number of the last frame with what the plan needs in view (`clue_steps`); None if
            there is none.
        trajectory: the trajectory's own file, for what it has retrieved (`retrieved`); None
            if it is not known.
    """

    segments: Sequence[PlanSegment]
    present: PlanSegment
    state: str = ""
    logs: Sequence[ObjectLog] = ()
    clue: int | None = None
    trajectory: Trajectory | None = None

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
        return [step.frame for step in self.observations()[:-1]]

    def observations(self, blank: bool = False, privileged: bool = False) -> list[Observation]:
        """Return all steps as a memory observes them, the present one last.

        Args:
            blank: whether their frames are grey.
            privileged: whether they have their logs.
        """
        steps: list[tuple[FrameRef, str | None, str | None]] = []
        goal = None
        for segment in self.all:
            goal = segment.goal or goal
            if not steps:
                steps.append((segment.before, None, goal))
            steps += [(frame, action, goal) for action, frame in segment.steps]
        return [
            Observation(
                number=number,
                frame=blank_like(frame) if blank else frame,
                action=action,
                goal=of_step,
                log=self.logs[number] if privileged else None,
            )
            for number, (frame, action, of_step) in enumerate(steps)
        ]


class History(Protocol):
    """Selects a model's past; `needs_state` is True if it needs the state in words."""

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what the model is given before the first action of a plan.

        Args:
            count: counts the tokens of some parts; returns None if the model does not count.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the required parts do not fit.
        """


class ChosenHistory(History):
    """What is chosen of the earlier steps, the goal, the present frame, and the plan."""

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        present = past.present
        chosen = self.choose(past, count)
        return [*chosen, goal_part(past.goal), present.before, plan_part(present.plan)]

    @abstractmethod
    def choose(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what is chosen, in order; see `recall`."""
