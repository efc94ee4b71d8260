"""Effects on objects: slicing, breaking, heating, cooling, cleaning and filling."""

import numpy as np

from infthor_sim.geometry import yaw_matrix
from infthor_sim.object_types import type_named
from infthor_sim.objects import SimObject
from infthor_sim.world import World

_TAP_REACH = 0.5  # metres from the middle of a tap to the basin that it fills


def slice_object(world: World, target: SimObject) -> list[SimObject]:
    """Replace an object by its slices, or an egg by its cracked self; return the new objects.

    Their ids are the old one's and `|AppleSliced_1` and so on, as in AI2-THOR.
    """
    name = target.type.slice_type
    count = target.type.slices
    owner = None if target.parent is None else world.objects[target.parent]
    axis = _slicing_axis(world, target)
    length = float(target.box_size[axis])
    size = target.box_size.copy()
    size[axis] = length / count
    middle = target.center
    matrix = yaw_matrix(float(target.rotation[1]))
    world.remove(target)
    pieces = []
    for number in range(1, count + 1):
        piece = target.duplicate(f"{target.object_id}|{name}_{number}")
        piece.type = type_named(name)
        piece.name = f"{target.name}_{name}_{number}"
        piece.box_size, piece.box_center, piece.asset_id = size.copy(), np.zeros(3), ""
        offset = np.zeros(3)
        offset[axis] = (number - 0.5) * length / count - length / 2
        piece.rotation = np.array([0.0, float(target.rotation[1]), 0.0])
        piece.position = middle + matrix @ offset
        piece.state.sliced = not target.type.cracks
        piece.state.picked_up = False
        world.add(piece)
        if owner is not None:
            world.attach(piece, owner)
        pieces.append(piece)
    return pieces


def _slicing_axis(world: World, target: SimObject) -> int:
    """Return the level axis most across the agent's view, so that no slice hides the next."""
    across = target.matrix.T @ world.agent.camera_matrix()[:, 0]
    return 0 if abs(across[0]) >= abs(across[2]) else 2


def break_object(world: World, target: SimObject) -> None:
    """Break an object; an egg cracks, and what was in a vessel spills."""
    if target.type.cracks:
        slice_object(world, target)
        return
    target.state.broken = True
    target.state.fill_liquid = None
    world.mark_changed(target)


def toggle(world: World, target: SimObject, on: bool) -> None:
    """Switch an object and what it controls, and apply heat, water and coffee."""
    target.state.toggled = on
    world.mark_changed(target)
    for controlled in target.controls:
        item = world.objects.get(controlled)
        if item is not None:
            item.state.toggled = on
            world.mark_changed(item)
    apply_sources(world)


def apply_sources(world: World) -> None:
    """Apply every source of heat, cold and liquid to what is in it now; runs after each action."""
    for source in list(world.objects.values()):
        if source.type.cold_source:
            _chill(world, source)
        elif not source.state.toggled:
            continue
        elif source.type.pours:
            _pour(world, source)
        elif source.type.heat_source:
            _heat(world, source)
        elif source.type.runs_water:
            _rinse(world, source)


def _pour(world: World, source: SimObject) -> None:
    for item in world.children(source):
        if item.type.fillable and item.state.fill_liquid is None:
            item.state.fill_liquid = source.type.pours
            item.state.temperature = "Hot"
            world.mark_changed(item)


def _heat(world: World, source: SimObject) -> None:
    for item in world.descendants(source):
        cooks = item.type.cookable and not item.state.cooked
        if item.state.temperature != "Hot" or cooks:
            item.state.temperature = "Hot"
            item.state.cooked = item.state.cooked or cooks
            world.mark_changed(item)


def _chill(world: World, source: SimObject) -> None:
    if source.state.openness > 0:
        return
    for item in world.descendants(source):
        if item.state.temperature != "Cold":
            item.state.temperature = "Cold"
            world.mark_changed(item)


def _rinse(world: World, source: SimObject) -> None:
    """Clean and fill what stands in the basin below a running tap."""
    low, high = source.bounds()
    middle = (low + high) / 2
    for basin in world.objects.values():
        if not basin.type.basin:
            continue
        b_low, b_high = basin.bounds()
        outside = (middle < b_low - _TAP_REACH) | (middle > b_high + _TAP_REACH)
        if outside[0] or outside[2]:
            continue
        for item in world.descendants(basin):
            fills = item.type.fillable and item.state.fill_liquid is None and not item.state.broken
            if item.state.dirty or fills:
                item.state.dirty = False
                item.state.fill_liquid = "water" if fills else item.state.fill_liquid
                world.mark_changed(item)
