"""What the suite of manipulation writes into a run's journal: episodes, each with all that the arm did."""

from enum import StrEnum
from typing import Any

import msgspec

from infthor_eval.runs.records import RecordTypes

__all__ = ["RECORDS", "ArmEnded", "ArmRecord", "ArmStep"]

Call = dict[str, Any]
Place = tuple[float, float, float]
_COLLIDED = "Collided"  # as AI2-THOR's message begins


class ArmEnded(StrEnum):
    """How an episode ended."""

    DONE = "done"
    ELSEWHERE = "released elsewhere"
    GAVE_UP = "gave up"
    LIMIT = "step limit"


class ArmStep(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One step of an arm.

    Attributes:
        delta: what a policy asked for: translation (m), rotation (rad), gripper; None of baselines.
        calls: what the simulator was asked, as JSON values.
        hand: centre of the hand's sphere after it, metres in the world.
        distance: metres from there to the nearest point of the target's box: the object, or where it is to be put.
        refusals: what the simulator refused, in its words: the arm met something, or closed around nothing.
    """

    delta: tuple[float, ...] | None = None
    calls: tuple[Call, ...] = ()
    hand: Place = (0.0, 0.0, 0.0)
    distance: float = 0.0
    refusals: tuple[str, ...] = ()

    @property
    def n_collisions(self) -> int:
        """How many movements met something."""
        return sum(text.startswith(_COLLIDED) for text in self.refusals)


class ArmRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="arm"):
    """One episode, and what an arm did in it.

    Attributes:
        index: of the expert's low-level action that it stands for.
        kind: "pickup" or "put".
        instruction: what a policy is told.
        object_id: what is to be picked up or put, as this simulator names it.
        receptacle_id: where to, likewise; None of pick-ups.
        steps: what the arm did.
        starts_inside: whether the object lies in the hand's sphere at the start; of pick-ups alone.
        start_distance: metres from the hand's sphere's centre to the target's box at the start.
        closest: the same at its smallest.
        reward: what was earned.
        max_reward: what could be.
        ended: how it ended, see `ArmEnded`; empty where nobody acted.
    """

    index: int
    kind: str
    instruction: str
    object_id: str = ""
    receptacle_id: str | None = None
    steps: tuple[ArmStep, ...] = ()
    starts_inside: bool = False
    start_distance: float = 0.0
    closest: float = 0.0
    reward: float = 0.0
    max_reward: float = 0.0
    ended: str = ""

    @property
    def attempted(self) -> bool:
        """Whether the arm acted in the episode; an actor that gives up at once has taken no step."""
        return bool(self.ended)

    @property
    def done(self) -> bool:
        """Whether the episode was a success."""
        return self.ended == ArmEnded.DONE

    @property
    def n_collisions(self) -> int:
        """How many movements met something."""
        return sum(step.n_collisions for step in self.steps)


RECORDS = RecordTypes(unit=ArmRecord)
