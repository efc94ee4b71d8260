"""Actions that set one state of an object: cook, clean, dirty, break, fill, empty, use up."""

from functools import partial
from typing import Any, NamedTuple

from infthor_sim.actions.registry import action
from infthor_sim.actions.targets import BY_ID_OR_PIXEL, interactable, object_action
from infthor_sim.effects import break_object
from infthor_sim.errors import ActionError
from infthor_sim.objects import SimObject
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation

_LIQUIDS = ("coffee", "wine", "water")
_ABILITIES = {  # attribute of `ObjectType`, by AI2-THOR's name of the property
    "CanBeCooked": "cookable",
    "CanBeDirty": "dirtyable",
    "CanBeFilled": "fillable",
    "CanBeUsedUp": "usable_up",
    "CanBreak": "breakable",
}


class _StateAction(NamedTuple):
    """An action that gives one attribute of an object's state a value.

    Attributes:
        name: name of the action.
        ability: AI2-THOR's name of the property that the object must have.
        values: attributes of `SimObjectState` and their new values; the first must change.
        refusal: what the message says of an object that is so already.
    """

    name: str
    ability: str
    values: dict[str, Any]
    refusal: str


_ACTIONS = (
    _StateAction(
        "CookObject", "CanBeCooked", {"cooked": True, "temperature": "Hot"}, "is already Cooked!"
    ),
    _StateAction("CleanObject", "CanBeDirty", {"dirty": False}, "is already Clean!"),
    _StateAction("DirtyObject", "CanBeDirty", {"dirty": True}, "is already dirty!"),
    _StateAction("EmptyLiquidFromObject", "CanBeFilled", {"fill_liquid": None}, "is already empty"),
    _StateAction("UseUpObject", "CanBeUsedUp", {"used_up": True}, "is already used up"),
)


def _set_state(sim: Simulation, target: SimObject, spec: _StateAction) -> None:
    _require(target, spec.ability)
    attribute, value = next(iter(spec.values.items()))
    # By truth and not by value: a vessel full of one liquid is not filled with another.
    if bool(getattr(target.state, attribute)) == bool(value):
        raise ActionError(f"{target.object_id} {spec.refusal}")
    for name, new in spec.values.items():
        setattr(target.state, name, new)
    sim.world.mark_changed(target)


for _spec in _ACTIONS:
    object_action(_spec.name)(partial(_set_state, spec=_spec))


@action("FillObjectWithLiquid", overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)
def fill(
    sim: Simulation,
    fillLiquid: str,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Fill a vessel with coffee, wine or water."""
    target = interactable(sim, objectId, forceAction, x, y)
    if fillLiquid not in _LIQUIDS:
        raise ActionError(f"{fillLiquid} is not a valid Liquid; use one of {', '.join(_LIQUIDS)}")
    spec = _StateAction(
        "FillObjectWithLiquid", "CanBeFilled", {"fill_liquid": fillLiquid}, "is already Filled!"
    )
    _set_state(sim, target, spec)


@object_action("BreakObject")
def smash(sim: Simulation, target: SimObject) -> None:
    """Break an object."""
    _require(target, "CanBreak")
    if target.state.broken:
        raise ActionError(f"{target.object_id} is already broken")
    if target.object_id in sim.world.held_ids() and target.type.cracks:
        raise ActionError("target object is in the agent's hand; put it down to crack it")
    break_object(sim.world, target)


def _require(target: SimObject, ability: str) -> None:
    if not getattr(target.type, _ABILITIES[ability]):
        raise ActionError(f"{target.object_id} does not have {ability} property!")
