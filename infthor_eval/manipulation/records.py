"""What manipulation writes into a run's journal: episodes, with everything that the arm did."""

from enum import StrEnum
from typing import Any

import msgspec

from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.manipulation.config import ManipulationConfig
from infthor_eval.manipulation.kinds import PutCriterion
from infthor_eval.quantities import Amount, Number
from infthor_eval.runs.journals.records import RecordTypes

Call = dict[str, Any]
Point = tuple[Number, Number, Number]
_COLLIDED = "Collided"  # beginning of AI2-THOR's message


class ArmEnded(StrEnum):
    """How an episode ended."""

    DONE = "done"
    ELSEWHERE = "released elsewhere"
    OTHER = "took the other"
    GAVE_UP = "gave up"
    LIMIT = "step limit"


class ArmStep(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One step of an arm.

    Attributes:
        delta: request of a policy: translation (m), rotation (rad), gripper; None for baselines.
        calls: calls of the simulator, as JSON values.
        hand: centre of the hand's sphere after it, metres in the world.
        distance: metres from there to the nearest point of the target's box: the object's, or the
            receptacle's of a put.
        refusals: messages of the simulator on calls that it refused: the arm collided, or closed
            around nothing.
    """

    delta: tuple[Number, ...] | None = None
    calls: tuple[Call, ...] = ()
    hand: Point = (0.0, 0.0, 0.0)
    distance: Amount = 0.0
    refusals: tuple[str, ...] = ()

    @property
    def n_collisions(self) -> int:
        """Number of movements that collided."""
        return sum(text.startswith(_COLLIDED) for text in self.refusals)


class ArmRecord(
    EpisodeRecord, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="arm"
):
    """One pick-up or put, and what an arm did in it.

    `index` is that of the expert's low-level action that it replaces.

    Attributes:
        object_id: id of the object that is picked up or put, in this simulator.
        receptacle_id: id of the receptacle that it is put into; None for pick-ups.
        starts_inside: whether the object is in the hand's sphere at the start; for pick-ups alone.
        start_distance: metres from the centre of the hand's sphere to the target's box at the
            start.
        closest: smallest such distance.
        max_reward: reward of a success.
        put_criterion: when a put succeeds.
        pair: name of the pair of choices between two things that it is of; empty for others.
        base: what both worlds of the pair are made of; likewise.
        nears_other: whether the hand had, or was nearer to, the other thing in the end and not the
            one that is named; None for others.
    """

    instruction: str
    object_id: str = ""
    receptacle_id: str | None = None
    steps: tuple[ArmStep, ...] = ()
    starts_inside: bool = False
    start_distance: Amount = 0.0
    closest: Amount = 0.0
    max_reward: Number = 0.0
    put_criterion: PutCriterion = PutCriterion.AT_REST
    pair: str = ""
    base: str = ""
    nears_other: bool | None = None

    @property
    def done(self) -> bool:
        """Whether it is a success."""
        return self.released if self.put_criterion == PutCriterion.RELEASE else super().done

    @property
    def released(self) -> bool:
        """Whether the object of a put was released, wherever."""
        return self.ended in (ArmEnded.DONE, ArmEnded.ELSEWHERE)

    @property
    def n_collisions(self) -> int:
        """Number of movements that collided."""
        return sum(step.n_collisions for step in self.steps)


RECORDS = RecordTypes(unit=ArmRecord, config=ManipulationConfig)
