"""What happened while trajectories were generated: tasks tried, failures, and roll-backs."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class RollBack:
    """Sub-goals that were dropped at a dead end.

    Attributes:
        from_step: number of low-level actions before.
        to_step: number of low-level actions that were left.
        subgoals: number of dropped sub-goals.
    """

    from_step: int
    to_step: int
    subgoals: int

    def __str__(self) -> str:
        words = "1 sub-goal" if self.subgoals == 1 else f"{self.subgoals} sub-goals"
        return f"{words} at step {self.from_step}, back to {self.to_step}"


@dataclass
class AttemptStatistics:
    """Numbers of one attempt at a trajectory, or of several.

    Attributes:
        tried: tasks of which at least one action was executed, by type.
        accepted: those that were completed and validated, by type; some may have been dropped
            later.
        reasons: failed tasks of which an action was executed, by reason.
        not_executed: sampled tasks of which nothing was executed, by reason.
        roll_backs: sub-goals that were dropped at dead ends.
        pool_restarts: numbers of low-level actions at which all tasks had been drawn and the pool
            began again.
        gave_up: True if the trajectory gave up before its lengths were reached, and was kept as far
            as it got.
    """

    tried: Counter[str] = field(default_factory=Counter)
    accepted: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    not_executed: Counter[str] = field(default_factory=Counter)
    roll_backs: list[RollBack] = field(default_factory=list)
    pool_restarts: list[int] = field(default_factory=list)
    gave_up: bool = False

    def add(self, other: "AttemptStatistics") -> None:
        """Add the numbers of another attempt."""
        self.tried += other.tried
        self.accepted += other.accepted
        self.reasons += other.reasons
        self.not_executed += other.not_executed
        self.roll_backs += other.roll_backs
        self.pool_restarts += other.pool_restarts

    def document(self) -> dict[str, Any]:
        """Return the numbers as JSON values, as they are stored in `gen_info`.

        `banked_on_giveup` is there only if it is true, as published.
        """
        banked = {"banked_on_giveup": True} if self.gave_up else {}
        return {
            "tried": dict(self.tried),
            "accepted": dict(self.accepted),
            "failures": dict(self.reasons.most_common()),
            "not_executed": dict(self.not_executed.most_common()),
            "roll_backs": [vars(item) for item in self.roll_backs],
            "pool_restarts": self.pool_restarts,
            **banked,
        }
