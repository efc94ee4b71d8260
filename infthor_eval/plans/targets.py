"""What a plan is about, in the simulator at hand."""

from dataclasses import dataclass

from infthor_eval.household.navigation import GridPose
from infthor_eval.plans.plan import Plan, PlanKind, UnfitPlanError
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.view import SimulatorView

__all__ = ["PlanTarget", "in_hand", "subject_of", "target_of"]

_TREATMENTS = {PlanKind.CLEAN, PlanKind.HEAT, PlanKind.COOL}


@dataclass(frozen=True)
class PlanTarget:
    """What a plan asks for.

    Attributes:
        kind: what is to be done.
        object_id: with what, as this simulator names it.
        receptacle_id: where to, likewise; PutObject alone needs it.
        goal_stand: for GotoLocation, where to stand, in the cells of the plan's grid.
        goal_horizon: for GotoLocation, the camera's angle there, degrees downwards.
    """

    kind: PlanKind
    object_id: str | None = None
    receptacle_id: str | None = None
    goal_stand: GridPose | None = None
    goal_horizon: float = 0.0


def target_of(plan: Plan, grounding: Grounding, view: SimulatorView) -> PlanTarget:
    """What a recorded plan asks for here; where GotoLocation leads the environment alone can tell.

    Args:
        plan: the plan.
        grounding: the episode's ids.
        view: the world at the plan's start.

    Raises:
        UnfitPlanError: the scene has no object for an id.
    """
    return PlanTarget(plan.kind, _here(plan.object_id, grounding, view), _here(plan.receptacle_id, grounding, view))


def subject_of(target: PlanTarget, start: SimulatorView) -> str | None:
    """The object that a plan is about.

    ALFRED's plans of washing, heating and cooling name the appliance: there it is what is in the hand at the start.

    Args:
        target: the plan's.
        start: the world at its start.

    Returns:
        None where nothing is named, and nothing held.
    """
    if target.kind in _TREATMENTS:
        named = start.objects.get(target.object_id or "")
        if named is None or not named.pickupable:
            return next(iter(start.inventory), None)
    return target.object_id


def in_hand(wanted: str, view: SimulatorView) -> bool:
    """Whether an object is held, or another slice of the same thing: words do not tell slices apart."""
    return any(held == wanted or _are_slices_of_one(held, wanted) for held in view.inventory)


def _are_slices_of_one(one: str, other: str) -> bool:
    parts = [key.rpartition("|") for key in (one, other)]
    return parts[0][0] == parts[1][0] and all("Sliced" in part for _, _, part in parts)


def _here(recorded: str | None, grounding: Grounding, view: SimulatorView) -> str | None:
    if recorded is None:
        return None
    found = grounding.ground(recorded, view)
    if found is None:
        raise UnfitPlanError(f"the scene has no object for {recorded!r:.80}")
    return found
