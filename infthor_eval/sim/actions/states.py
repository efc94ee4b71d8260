"""Direct changes of an object's state: cook, clean, dirty, break, fill, empty, use up."""

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.actions.targets import BY_ID_OR_PIXEL, interactable
from infthor_eval.sim.effects import break_object
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []

_LIQUIDS = ("coffee", "wine", "water")


@action("CookObject", forms=BY_ID_OR_PIXEL)
def cook(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Cook an object."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.cookable, "CanBeCooked")
    if target.state.cooked:
        raise ActionError(f"{target.object_id} is already Cooked!")
    target.state.cooked = True
    target.state.temperature = "Hot"
    sim.world.touch(target)


@action("CleanObject", forms=BY_ID_OR_PIXEL)
def clean(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Clean a dirty object."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.dirtyable, "CanBeDirty")
    if not target.state.dirty:
        raise ActionError(f"{target.object_id} is already Clean!")
    target.state.dirty = False
    sim.world.touch(target)


@action("DirtyObject", forms=BY_ID_OR_PIXEL)
def make_dirty(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Make an object dirty."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.dirtyable, "CanBeDirty")
    if target.state.dirty:
        raise ActionError(f"{target.object_id} is already dirty!")
    target.state.dirty = True
    sim.world.touch(target)


@action("BreakObject", forms=BY_ID_OR_PIXEL)
def smash(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Break an object."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.breakable, "CanBreak")
    if target.state.broken:
        raise ActionError(f"{target.object_id} is already broken")
    if target.object_id in sim.world.carried() and target.type.cracks:
        raise ActionError("target object is in the agent's hand; put it down to crack it")
    break_object(sim.world, target)


@action("FillObjectWithLiquid", forms=BY_ID_OR_PIXEL)
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
    _require(target, target.type.fillable, "CanBeFilled")
    if target.state.fill_liquid is not None:
        raise ActionError(f"{target.object_id} is already Filled!")
    target.state.fill_liquid = fillLiquid
    sim.world.touch(target)


@action("EmptyLiquidFromObject", forms=BY_ID_OR_PIXEL)
def empty(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Empty a vessel."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.fillable, "CanBeFilled")
    if target.state.fill_liquid is None:
        raise ActionError(f"{target.object_id} is already empty")
    target.state.fill_liquid = None
    sim.world.touch(target)


@action("UseUpObject", forms=BY_ID_OR_PIXEL)
def use_up(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Use an object up, e.g. a soap bottle."""
    target = interactable(sim, objectId, forceAction, x, y)
    _require(target, target.type.usable_up, "CanBeUsedUp")
    if target.state.used_up:
        raise ActionError(f"{target.object_id} is already used up")
    target.state.used_up = True
    sim.world.touch(target)


def _require(target: SimObject, capable: bool, property_name: str) -> None:
    if not capable:
        raise ActionError(f"{target.object_id} does not have {property_name} property!")
