# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Picking up, putting, opening, closing, toggling and slicing."""

from functools import partial

from infthor_sim.actions.registry import action
from infthor_sim.actions.targets import BY_ID_OR_PIXEL, held_object, interactable, object_action
from infthor_sim.effects import slice_object, toggle
from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.object_types import allowed_in
from infthor_sim.objects import SimObject
from infthor_sim.physics.doorways import hits_agent, update_floor
from infthor_sim.physics.free_places import InTheWay, find_place
from infthor_sim.physics.receptacles import drawer_offset
from infthor_sim.physics.solids import unfold
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation

# Overlaps of boxes that `forceAction` tolerates in a full receptacle of a recording, smallest
# first: recorded boxes are coarse. Where things are drawn to the box, an overlap would show.
_CROWDED = (0.12, 0.24, 0.35)


@action("PickupObject", overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)
def pick_up(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
    manualInteract: bool = False,
) -> None:
    """Take an object into the hand, with all it contains."""
    target = interactable(sim, objectId, forceAction, x, y)
    if not target.type.pickupable:
        raise ActionError(
            f"{target.object_id} must have the property CanPickup to be picked up.",
            ErrorCode.NOT_PICKUPABLE,
        )
    world = sim.world
    if world.agent.held is not None:
        raise ActionError(
            "Agent hand has something in it already! Can't pick up anything else. Holding "
            f"{world.agent.held}.",
            ErrorCode.INVENTORY_FULL,
        )
    if target.object_id in world.held_ids():
        raise ActionError(f"{target.object_id} is in the hand of another agent")
    world.detach(target)
    world.agent.held = target.object_id
    target.state.picked_up = True
    world.carry()


@action("PutObject", overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)
def put(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
    placeStationary: bool = True,
    randomSeed: int = 0,
    putNearXY: bool = False,
) -> None:
    """Put the held object into or onto the receptacle `objectId`."""
    held = held_object(sim, "Can't place an object if Agent isn't holding anything in their hand.")
    target = interactable(sim, objectId, forceAction, x, y)
    _check_receptacle(held, target)
    placed = _find_place(sim, held, target, forceAction)
    if placed is None:
        raise ActionError("No valid positions to place object found", ErrorCode.RECEPTACLE_FULL)
    sim.world.set_pose(held, placed.position, placed.rotation)
    sim.world.release()
    sim.world.attach(held, target)
    sim.world.mark_changed()


def _find_place(
    sim: Simulation, held: SimObject, target: SimObject, force: bool
) -> SimObject | None:
    """Return the held object at the best free place; a forced put squeezes in where it is full."""
    # A recording's boxes are too large, so a forced put goes among them where nothing else is free:
    # Unity, which has the meshes, would find room there. Best first: without overlap, in view.
    squeezing = force and sim.world.coarse
    for overlap in (0.0, *_CROWDED) if squeezing else (0.0,):
        for in_the_way in InTheWay if squeezing else (InTheWay.DRAWN,):
            for point_filter in (sim.vision.in_frame, None):
                placed = find_place(
                    sim.world,
                    held,
                    target,
                    overlap,
                    point_filter=point_filter,
                    in_the_way=in_the_way,
                )
                if placed is not None:
                    return placed
    return None


def _check_receptacle(held: SimObject, target: SimObject) -> None:
    if not target.type.receptacle:
        raise ActionError(f"This target object is NOT a receptacle! {target.object_id}")
    if target.type.encloses and target.type.openable and target.state.openness == 0:
        raise ActionError("Target openable Receptacle is CLOSED, can't place if target is not "
                          "open!",
                          ErrorCode.RECEPTACLE_CLOSED)  # fmt: skip
    if not allowed_in(held.object_type, target.object_type):
        raise ActionError(
            f"{held.object_id} cannot be placed in {target.object_id}", ErrorCode.NOT_ALLOWED
        )


@action("OpenObject", overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)
def open_object(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
    openness: float = 1.0,
    moveMagnitude: float | None = None,
) -> None:
    """Open a door, drawer or lid to `openness`, 0 (closed) to 1."""
    if moveMagnitude is not None:
        openness = moveMagnitude or 1.0  # the old name of `openness`; its 0 meant wide open
    if not 0 <= openness <= 1:
        raise ActionError(f"openness must be in [0:1], not {openness}")
    target = interactable(sim, objectId, forceAction, x, y)
    if not target.type.openable:
        raise ActionError(f"{target.object_id} is not an Openable object")
    if target.state.openness == openness and openness > 0:
        raise ActionError(f"object already open: {target.object_id}")
    if target.state.toggled and target.type.runs_closed and openness > 0:
        raise ActionError(f"Can't open {target.object_id}: it is on. Turn it off first.")
    _swing(sim, target, openness)


@object_action("CloseObject")
def close_object(sim: Simulation, target: SimObject) -> None:
    """Close a door, drawer or lid."""
    if not target.type.openable:
        raise ActionError(f"{target.object_id} is not an Openable object")
    if target.state.openness == 0:
        raise ActionError(f"object already closed: {target.object_id}")
    _swing(sim, target, 0.0)


def _swing(sim: Simulation, target: SimObject, openness: float) -> None:
    """Open or close an object, unless the door of a room would hit an agent on its way."""
    if target.type.in_doorway and hits_agent(sim.world, target, openness):
        raise ActionError("Object failed to open/close successfully.")
    set_openness(sim, target, openness)


def set_openness(sim: Simulation, target: SimObject, openness: float) -> None:
    """Open or close an object; the contents of a drawer move with it."""
    before = drawer_offset(target)
    unfold(target, openness)
    target.state.openness = float(openness)
    if target.type.in_doorway:
        update_floor(sim.world)
    sim.world.shift(sim.world.children(target), drawer_offset(target) - before)
    sim.world.mark_changed(target)


def _toggle(sim: Simulation, target: SimObject, on: bool) -> None:
    if not target.type.toggleable:
        raise ActionError(f"{target.object_id} is not toggleable")
    if target.type.switched_by:
        raise ActionError(
            f"{target.object_id} is not self controlled; toggle its {target.type.switched_by}"
        )
    if target.state.toggled == on:
        raise ActionError(f"{target.object_id} is already toggled {'on' if on else 'off'}!")
    if on and target.type.runs_closed and target.state.openness > 0:
        raise ActionError(f"Target {target.object_id} must be closed to be toggled on.")
    if target.state.broken:
        raise ActionError(f"{target.object_id} is broken and cannot be toggled.")
    toggle(sim.world, target, on)


for _name, _on in (("ToggleObjectOn", True), ("ToggleObjectOff", False)):
    object_action(_name)(partial(_toggle, on=_on))


@object_action("SliceObject")
def slice_target(sim: Simulation, target: SimObject) -> None:
    """Cut an object into slices, which are new objects."""
    if not target.type.sliceable:
        raise ActionError(f"{target.object_id} Does not have the CanBeSliced property!")
    if target.object_id in sim.world.held_ids():
        raise ActionError("target object is in the agent's hand; put it down to slice it")
    slice_object(sim.world, target)
