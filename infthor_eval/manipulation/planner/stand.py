"""Where an agent with an arm stands."""

import math
from dataclasses import dataclass

from infthor_eval.thor.view import AgentPose

__all__ = ["ArmStand"]

_FLOOR = 0.9  # metres from the agent's position down to the floor
_RANGE = 0.451, 1.801  # metres: heights of the arm's base above the floor


@dataclass(frozen=True)
class ArmStand:
    """Where an agent stands: the range of heights of its arm's base, metres, and its direction,
    radians."""

    low: float
    high: float
    heading: float

    @classmethod
    def of(cls, agent: AgentPose) -> "ArmStand":
        """Return the stand of an agent; AI2-THOR's agents with an arm are all of the same
        height."""
        floor = agent.position.y - _FLOOR
        return cls(floor + _RANGE[0], floor + _RANGE[1], math.radians(agent.rotation))

    @property
    def floor(self) -> float:
        """Height of the floor, metres."""
        return self.low - _RANGE[0]

    def share(self, base: float) -> float:
        """Return a height of the base as `MoveArmBase` takes it, from 0 to 1."""
        return min(1.0, max(0.0, (base - self.low) / (self.high - self.low)))
