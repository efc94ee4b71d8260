"""Positions that the agent can reach, and poses from which it can interact with an object."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.agent import MAX_UP, Agent
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, euler_matrix, level_gaps, to_array
from infthor_sim.objects import SimObject
from infthor_sim.physics.crowd import free_cells
from infthor_sim.render.probe import VisibilityProbe
from infthor_sim.simulation import Simulation

_FINEST = 0.01  # metres; finer grids have millions of points
TILT = 30.0  # degrees between the horizons that are tried


@action("GetReachablePositions", query=True)
def get_reachable_positions(
    sim: Simulation,
    maxStepCount: int = 10000,
    directionsRelativeAgent: bool = False,
    gridSize: float | None = None,
) -> list[dict[str, float]]:
    """Return positions that the agent can reach by steps of `gridSize`, along the axes or its
    own."""
    step = sim.settings.grid_size if gridSize is None else gridSize
    if step < _FINEST:
        raise ActionError(f"gridSize must be at least {_FINEST}, not {step}")
    agent = sim.world.agent
    yaw = agent.yaw if directionsRelativeAgent else 0.0
    cells = free_cells(sim.world)
    points = cells.reachable_points(agent.position[0], agent.position[2], step, yaw)
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
    tilts = _range(-MAX_UP, sim.world.agent.max_down, TILT) if horizons is None else horizons
    heights = [True, False] if standings is None else standings
    places = get_reachable_positions(sim) if positions is None else positions
    near = [p for p in places if level_gaps(to_array(p)[[0, 2]], *item.bounds()) <= reach]
    if sim.world.is_hidden(item):
        return []
    return list(islice(_seeing_poses(sim, item, near, (tilts, turns, heights)), maxPoses))


def _seeing_poses(
    sim: Simulation,
    item: SimObject,
    places: Iterable[Mapping[str, float]],
    angles: tuple[Sequence[float], Sequence[float], Sequence[bool]],
) -> Iterator[dict[str, Any]]:
    """Yield the poses (places by horizons, rotations, standings) from which an object is seen."""
    tilts, turns, heights = angles
    if not (tilts and turns and heights):
        return
    probe = sim.vision.probe(item)
    matrices = np.array(
        [euler_matrix((tilt, turn % 360.0, 0.0)) for tilt, turn in product(tilts, turns)]
    ).reshape(len(tilts), len(turns), 3, 3)
    for place in places:
        agent = replace(sim.world.agent, position=to_array(place))
        seen = [_seen(sim, replace(agent, standing=h), turns, matrices, probe) for h in heights]
        for (i, tilt), (j, turn), (k, standing) in product(*map(enumerate, angles)):
            if seen[k][i, j]:
                yield {**place, "rotation": turn, "standing": standing, "horizon": tilt}


def _seen(
    sim: Simulation, agent: Agent, turns: Sequence[float], matrices: Array, probe: VisibilityProbe
) -> NDArray[np.bool_]:
    """Return in which directions (tilts, turns) of (tilts, turns, 3, 3) the object is seen."""
    if agent.eye[0] == agent.eye[2] == 0:  # turning does not move the camera
        seen = sim.vision.sees_from(agent, matrices.reshape(-1, 3, 3), probe)
        return seen.reshape(matrices.shape[:2])
    columns = [
        sim.vision.sees_from(replace(agent, yaw=turn % 360.0), matrices[:, index], probe)
        for index, turn in enumerate(turns)
    ]
    return np.stack(columns, axis=1)


def _range(first: float, last: float, step: float) -> list[float]:
    return [first + index * step for index in range(int((last - first) / step) + 1)]
