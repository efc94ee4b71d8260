"""Positions that the agent can reach, and poses from which it can interact with an object."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice, product
from typing import Any

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.agent import MAX_DOWN, MAX_UP
from infthor_sim.errors import ActionError
from infthor_sim.geometry import level_gaps, to_array
from infthor_sim.objects import SimObject
from infthor_sim.simulation import Simulation

_FINEST = 0.01  # metres; finer grids have millions of points
_TILT = 30.0  # degrees between the horizons that are tried


@action("GetReachablePositions", query=True)
def get_reachable_positions(
    sim: Simulation,
    maxStepCount: int = 10000,
    directionsRelativeAgent: bool = False,
    gridSize: float | None = None,
) -> list[dict[str, float]]:
    """Return positions that the agent can reach by steps of `gridSize`, along the axes or its own.

    Raises:
        ActionError: the grid is too fine, or there are more than `maxStepCount` positions per
            square metre of a step.
    """
    step = sim.settings.grid_size if gridSize is None else gridSize
    if step < _FINEST:
        raise ActionError(f"gridSize must be at least {_FINEST}, not {step}")
    agent = sim.world.agent
    yaw = agent.yaw if directionsRelativeAgent else 0.0
    points = sim.world.nav.reachable_points(agent.position[0], agent.position[2], step, yaw)
    if len(points) > maxStepCount / step**2:
        raise ActionError("Too many steps taken in GetReachablePositions.")
    return [{"x": x, "y": float(agent.position[1]), "z": z} for x, z in points]


@action("GetInteractablePoses", query=True)
def get_interactable_poses(
    sim: Simulation,
    objectId: str,
    positions: list[Vector3] | None = None,
    rotations: list[float] | None = None,
    horizons: list[float] | None = None,
    standings: list[bool] | None = None,
    maxDistance: float | None = None,
    maxPoses: int = 2**31 - 1,
) -> list[dict[str, Any]]:
    """Return poses for TeleportFull from which the agent sees an object within its reach."""
    if maxPoses <= 0:
        raise ActionError("maxPoses must be greater than 0")
    item = sim.world.get(objectId)
    reach = sim.settings.visibility_distance if maxDistance is None else maxDistance
    turns = _range(0.0, 360.0 - 1e-6, sim.settings.rotate_step) if rotations is None else rotations
    tilts = _range(-MAX_UP, MAX_DOWN, _TILT) if horizons is None else horizons
    heights = [True, False] if standings is None else standings
    places = get_reachable_positions(sim) if positions is None else positions
    near = [p for p in places if level_gaps(to_array(p)[[0, 2]], *item.bounds()) <= reach]
    if sim.world.is_hidden(item):
        return []
    return list(islice(_seeing_poses(sim, item, product(near, tilts, turns, heights)), maxPoses))


def _seeing_poses(
    sim: Simulation,
    item: SimObject,
    poses: Iterable[tuple[Mapping[str, float], float, float, bool]],
) -> Iterator[dict[str, Any]]:
    """Yield those poses (position, horizon, rotation, standing) from which an object is seen."""
    probe = sim.vision.probe(item)
    for position, tilt, turn, standing in poses:
        if sim.vision.sees_from(
            replace(
                sim.world.agent,
                position=to_array(position),
                yaw=turn % 360.0,
                horizon=tilt,
                standing=standing,
            ),
            probe,
        ):
            yield {**position, "rotation": turn, "standing": standing, "horizon": tilt}


def _range(first: float, last: float, step: float) -> list[float]:
    return [first + index * step for index in range(int((last - first) / step) + 1)]
