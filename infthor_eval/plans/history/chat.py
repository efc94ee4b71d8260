"""What the published chat scripts of branch `dev` give an agent of the past."""

from typing import ClassVar

from infthor_eval.household.sequence_text import ACT, action_part, goal_part
from infthor_eval.plans.history.past import CountTokens, Past
from infthor_eval.plans.history.segments import Part

__all__ = ["GoalHistory", "PlanHistory"]


class GoalHistory:
    """The whole history with goals and actions; plans begin with a mark and have no text."""

    needs_state: ClassVar[bool] = False

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


class PlanHistory:
    """The plans before in words, without goal, frame or the plan; the present frame follows."""

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        plans = [segment.plan for segment in past.segments if segment.in_task]
        text = f"{'; '.join(plans)};" if plans else "No history is available."
        return [f"Action history: {text}\n"]
