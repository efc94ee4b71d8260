# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Direct changes of an object's state: cook, clean, dirty, break, fill, empty, use up; dropping and throwing."""

import numpy as np

from infthor_eval.sim.actions.interaction import release
from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.actions.targets import held_object, interactable
from infthor_eval.sim.effects import break_object
from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import owner_of
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []

_LIQUIDS = ("coffee", "wine", "water")
_DROP_BREAKS = 0.9  # metres of fall that break a breakable thing
_THROW_REACH = 0.9  # metres in front of the agent at which a thrown thing lands


@action("CookObject")
def cook(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Cook an object."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.cookable, "CanBeCooked")
    if target.state.cooked:
        raise ActionError(f"{objectId} is already Cooked!")
    target.state.cooked = True
    target.state.temperature = "Hot"
    sim.world.touch(target)


@action("CleanObject")
def clean(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Clean a dirty object."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.dirtyable, "CanBeDirty")
    if not target.state.dirty:
        raise ActionError(f"{objectId} is already Clean!")
    target.state.dirty = False
    sim.world.touch(target)


@action("DirtyObject")
def make_dirty(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Make an object dirty."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.dirtyable, "CanBeDirty")
    if target.state.dirty:
        raise ActionError(f"{objectId} is already dirty!")
    target.state.dirty = True
    sim.world.touch(target)


@action("BreakObject")
def smash(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Break an object."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.breakable, "CanBreak")
    if target.state.broken:
        raise ActionError(f"{objectId} is already broken")
    if target.object_id == sim.world.held and target.type.cracks:
        raise ActionError("target object is in the agent's hand; put it down to crack it")
    break_object(sim.world, target)


@action("FillObjectWithLiquid")
def fill(sim: Simulation, objectId: str, fillLiquid: str, forceAction: bool = False) -> None:
    """Fill a vessel with coffee, wine or water."""
    target = interactable(sim, objectId, forceAction, None, None)
    if fillLiquid not in _LIQUIDS:
        raise ActionError(f"{fillLiquid} is not a valid Liquid; use one of {', '.join(_LIQUIDS)}")
    _require(target, target.type.fillable, "CanBeFilled")
    if target.state.fill_liquid is not None:
        raise ActionError(f"{objectId} is already Filled!")
    target.state.fill_liquid = fillLiquid
    sim.world.touch(target)


@action("EmptyLiquidFromObject")
def empty(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Empty a vessel."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.fillable, "CanBeFilled")
    if target.state.fill_liquid is None:
        raise ActionError(f"{objectId} is already empty")
    target.state.fill_liquid = None
    sim.world.touch(target)


@action("UseUpObject")
def use_up(sim: Simulation, objectId: str, forceAction: bool = False) -> None:
    """Use an object up, e.g. a soap bottle."""
    target = interactable(sim, objectId, forceAction, None, None)
    _require(target, target.type.usable_up, "CanBeUsedUp")
    if target.state.used_up:
        raise ActionError(f"{objectId} is already used up")
    target.state.used_up = True
    sim.world.touch(target)


@action("DropHandObject")
def drop(sim: Simulation, forceAction: bool = False, autoSimulation: bool = True) -> None:
    """Let the held object fall to whatever is below it."""
    _let_go(sim, 0.0)


@action("ThrowObject")
def throw(sim: Simulation, moveMagnitude: float = 0.0, forceAction: bool = False, autoSimulation: bool = True) -> None:
    """Drop the held object a step in front of the agent; there is no flight."""
    _let_go(sim, _THROW_REACH)


def _let_go(sim: Simulation, ahead: float) -> None:
    held = held_object(sim)
    if held is None:
        raise ActionError("Nothing in agent's hand to drop!", ErrorCode.NOT_IN_INVENTORY)
    world = sim.world
    pose = held.duplicate(held.object_id)
    forward = world.agent.camera_matrix()[:, 2] * (1.0, 0.0, 1.0)
    low, high = world.scene_bounds()
    margin = held.box_size.max() / 2
    point = np.clip(
        held.center + forward * ahead, np.add(low, (margin, 0, margin)), np.subtract(high, (margin, 0, margin))
    )
    pose.place_bottom(np.array([point[0], _ground(sim, held, point), point[2]]))
    fall = float(held.bounds()[0][1] - pose.bounds()[0][1])
    release(sim, pose)
    owner = owner_of(world, held)
    if owner is not None:
        world.attach(held, owner)
    if held.type.breakable and not held.state.broken and fall > _DROP_BREAKS:
        break_object(world, held)


def _ground(sim: Simulation, held: SimObject, point: np.ndarray) -> float:
    """Height of the highest surface under `point` that is below the hand; 0 is the floor."""
    best = 0.0
    bottom = held.bounds()[0][1]
    for item in sim.world.objects.values():
        if item is held or item.type.pickupable or not item.type.receptacle or item.type.encloses:
            continue
        low, high = item.bounds()
        height = item.surface_height()
        inside = low[0] <= point[0] <= high[0] and low[2] <= point[2] <= high[2]
        if inside and best < height <= bottom:
            best = height
    return best


def _require(target: SimObject, capable: bool, property_name: str) -> None:
    if not capable:
        raise ActionError(f"{target.object_id} does not have {property_name} property!")
