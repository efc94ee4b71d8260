"""The objects and poses of a plan in this simulator."""

from dataclasses import dataclass

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.object_ids import Words
from infthor_eval.household.navigation import GridPose
from infthor_eval.plans.plan import Plan, PlanKind
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.view import SimulatorView

TREATMENTS = {PlanKind.CLEAN, PlanKind.HEAT, PlanKind.COOL}


@dataclass(frozen=True)
class PlanTarget:
    """What a plan asks for.

    Attributes:
        kind: kind of the plan.
        object_id: id of its object in this simulator.
        receptacle_id: id of its receptacle; PutObject alone needs it.
        goal_stand: cell and direction to reach by GotoLocation, in the plan's grid.
        goal_horizon: angle of the camera there, degrees downwards.
    """

    kind: PlanKind
    object_id: str | None = None
    receptacle_id: str | None = None
    goal_stand: GridPose | None = None
    goal_horizon: float = 0.0


def target_of(plan: Plan, grounding: Grounding, view: SimulatorView) -> PlanTarget:
    """Return a recorded plan's target at its start; GotoLocation's is of `PlanEnvironment`."""
    return PlanTarget(
        plan.kind,
        _here(plan.object_id, grounding, view),
        _here(plan.receptacle_id, grounding, view),
    )


def subject_of(target: PlanTarget, start: SimulatorView) -> str | None:
    """Return the id of the object that a plan changes; None if none is named or held.

    ALFRED's plans of washing, heating and cooling name the appliance; their object is the one held
    at the start.
    """
    if target.kind in TREATMENTS:
        named = start.objects.get(target.object_id or "")
        if named is None or not named.pickupable:
            return next(iter(start.inventory), None)
    return target.object_id


def in_hand(wanted: str, view: SimulatorView) -> bool:
    """Return whether an object of this name is held, whole or sliced: words do not say which."""
    return any(
        Words.PUBLISHED.name_of(held) == Words.PUBLISHED.name_of(wanted) for held in view.inventory
    )


def _here(recorded: str | None, grounding: Grounding, view: SimulatorView) -> str | None:
    if recorded is None:
        return None
    object_id = grounding.ground(recorded, view)
    if object_id is None:
        raise InfeasibleError(f"the scene has no object for {recorded!r:.80}")
    return object_id
