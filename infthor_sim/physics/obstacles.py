"""Obstacles that the navigation grid does not know: open doors and drawers, held objects."""

import numpy as np

from infthor_sim.agent import AGENT_RADIUS
from infthor_sim.geometry import Array, aabb_overlap, level_gaps, yaw_matrix
from infthor_sim.objects import DOOR_SWING, DRAWER_SLIDE, SimObject
from infthor_sim.world import World

# heights in metres between which a door stops the agent
_KNEE = 0.15
_HEAD = 1.5


def blocking_object(world: World, target: Array) -> str | None:
    """Return the name of the open door or drawer that keeps the agent from `target` (3,), or None.

    One that already touches the agent does not count, as the agent could not get away from it
    otherwise.
    """
    for item in world.objects.values():
        if item.object_id in world.open_at_start or item.state.openness <= 0:
            continue
        if item.type.in_doorway:  # whose floor is not in the grid
            continue
        leaf = door_leaf(item)
        if leaf is None or leaf[1][1] < _KNEE or leaf[0][1] > _HEAD:
            continue
        if _touches(leaf, target) and not _touches(leaf, world.agent.position):
            return item.name
    return None


def door_leaf(item: SimObject) -> tuple[Array, Array] | None:
    """Return the corners of the box around an open door or drawer; None for other objects."""
    if not (item.type.hinged or item.type.slides):
        return None
    width, height, depth = item.front_size
    matrix = item.matrix @ yaw_matrix(item.front)
    if item.type.slides:
        reach = DRAWER_SLIDE * depth * item.state.openness
        points = [(x, y, depth / 2 + z) for x in (-width / 2, width / 2) for y in (-height / 2,
                                                                                   height / 2)
                  for z in (0.0, reach)]  # fmt: skip
    else:
        ends = np.concatenate(_swung(item, item.state.openness))
        points = [(x, y, z) for x, _, z in ends for y in (-height / 2, height / 2)]
    world = np.array(points) @ matrix.T + item.center
    return world.min(axis=0), world.max(axis=0)


def leaves(door: SimObject, openness: float) -> list[Array]:
    """Return both ends (x, z) of each leaf (2, 2) of a door that is open so far, metres."""
    matrix = door.matrix @ yaw_matrix(door.front)
    return [(ends @ matrix.T + door.center)[:, [0, 2]] for ends in _swung(door, openness)]


def _swung(door: SimObject, openness: float) -> list[Array]:
    """Return both ends (2, 3) of each leaf in the frame of the door's box and front."""
    width, _, depth = (door.front_size / 2).tolist()
    share = 2 / len(door.leaf_sides)
    listed = []
    for side in door.leaf_sides:
        hinge = np.array([side * width, 0.0, depth])
        swing = yaw_matrix(side * DOOR_SWING * openness)
        listed.append(np.stack([hinge, hinge + swing @ np.array([-side * share * width, 0, 0])]))
    return listed


def held_object_blocks(world: World, target: Array) -> bool:
    """Return whether the held object would be outside the outer walls with the agent there."""
    if world.agent.held is None:
        return False
    held = world.objects[world.agent.held]
    offset = target - world.agent.position
    low, high = held.bounds()
    inside_low, inside_high = world.scene_bounds()
    return not aabb_overlap(low + offset, high + offset, inside_low, inside_high)


def nearest_name(world: World, point: Array) -> str:
    """Return the name of the furniture nearest to `point`, for messages about a stopped agent."""
    # The grid knows only that a cell is not free, and not what stands there.
    best = ("Wall", 0.6)  # beyond so many metres a wall is the likelier obstacle
    for item in world.objects.values():
        low, high = item.bounds()
        if item.type.pickupable or item.object_type == "Floor" or low[1] > 1.6 or high[1] < 0.2:
            continue
        gap = float(level_gaps(point[[0, 2]], low, high))
        if gap < best[1]:
            best = (item.name, gap)
    return best[0]


def _touches(box: tuple[Array, Array], position: Array) -> bool:
    return bool(level_gaps(position[[0, 2]], *box) < AGENT_RADIUS)
