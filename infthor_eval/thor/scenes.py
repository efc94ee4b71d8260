"""Scenes of a simulator: pictures of them, and recording them for machines without Unity.

A picture shows the room from the reachable position that shows most of what is in it.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError
from infthor_eval.formats.floor_plans import write_floor_plan
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, Vector, teleport_call

_N_POSITIONS = 24
_HEADINGS = (0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0)
_HORIZONS = (0.0, 20.0)  # degrees below the horizontal
_N_TRIALS = 2  # headings that are tried at a place
_HALF_FIELD = 30.0  # degrees to either side of the camera's axis
_NEAREST = 1.0  # metres; what is nearer hides the room
_SEEN = 0.001  # share of the frame from which on an object is seen
_LARGEST = 0.15  # share of the frame beyond which an object hides more of the room than it shows
_HIDDEN = 40  # objects that a frame's whole area would show


def scene_pictures(simulator: Simulator, scene: str) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the scene from above, and from where most of it is seen: uint8 [height, width, 3].

    Raises:
        SimulatorError: the simulator does not have the scene, or sends no frames.
    """
    first = simulator.reset(scene).frame
    if first is None:
        raise SimulatorError(
            f"scene {scene}: the simulator sends no frames; start it with rendering"
        )
    positions = [
        msgspec.convert(position, Vector)
        for position in _query(simulator, "GetReachablePositions").result
    ]
    pose = find_room_view(simulator, positions, first.shape[0] * first.shape[1])
    room = simulator.query(**teleport_call(pose)).frame
    above = _query(simulator, "ToggleMapView").frame
    assert room is not None
    assert above is not None
    return above, room


def dump_scene(simulator: Simulator, scene: str, folder: Path, overwrite: bool = False) -> int:
    """Record a scene's objects and positions as a floor plan; return its number of objects.

    Args:
        overwrite: True to replace a different recording of the scene.

    Raises:
        SimulatorError: the simulator does not have the scene.
        DataError: the folder has a different recording of the scene, or cannot be written.
    """
    simulator.reset(scene)
    objects = simulator.metadata["objects"]
    reachable = _query(simulator, "GetReachablePositions").result
    cells = [(position["x"], position["z"]) for position in reachable]
    write_floor_plan(folder, scene, objects, cells, overwrite)
    return len(objects)


def _query(simulator: Simulator, action: str) -> SimulatorView:
    view = simulator.query(action)
    if not view.success:
        raise SimulatorError(f"{action} failed: {view.error}; use AI2-THOR 5.x")
    return view


def find_room_view(simulator: Simulator, positions: Sequence[Vector], n_pixels: int) -> AgentPose:
    """Return the pose that shows most objects; the agent returns to its own.

    Places far from each other are tried, at each the headings with the most objects before the
    agent.

    Args:
        simulator: the simulator, with a scene; it renders instances.
        positions: positions that the agent can reach.
        n_pixels: number of pixels of a frame.
    """
    start = simulator.view
    poses = [
        replace(start.agent, position=position, rotation=heading, horizon=horizon)
        for position in _far_apart(positions)
        for heading in _promising_headings(start, position)
        for horizon in _HORIZONS
    ]
    best = max([start.agent, *poses], key=lambda pose: _score(simulator, pose, n_pixels))
    simulator.query(**teleport_call(start.agent), renderImage=False)
    return best


def _far_apart(positions: Sequence[Vector]) -> list[Vector]:
    """Choose positions one by one, each as far as possible from the others: corners first."""
    if not positions:
        return []
    points = np.array([(position.x, position.z) for position in positions])
    distances: NDArray[np.float64] = np.hypot(*(points - points.mean(axis=0)).T)
    chosen = []
    for _ in range(min(_N_POSITIONS, len(positions))):
        farthest = int(distances.argmax())
        chosen.append(positions[farthest])
        distances = np.minimum(distances, np.hypot(*(points - points[farthest]).T))
    return chosen


def _promising_headings(view: SimulatorView, position: Vector) -> list[float]:
    return sorted(_HEADINGS, key=lambda heading: -_n_before(view, position, heading))[:_N_TRIALS]


def _n_before(view: SimulatorView, position: Vector, heading: float) -> int:
    """Return the number of objects in the field of view, walls aside."""
    offsets = [
        (obj.position.x - position.x, obj.position.z - position.z) for obj in view.objects.values()
    ]
    return sum(
        math.hypot(dx, dz) >= _NEAREST
        and abs((math.degrees(math.atan2(dx, dz)) - heading + 180) % 360 - 180) <= _HALF_FIELD
        for dx, dz in offsets
    )


def _score(simulator: Simulator, pose: AgentPose, n_pixels: int) -> float:
    """Return how many objects a frame shows, less those that large ones hide; -1 where nobody can
    stand."""
    view = simulator.query(**teleport_call(pose, force=False), renderImage=False)
    if not view.success or not view.instances:
        return -1.0
    shares = [instance.pixels / n_pixels for instance in view.instances.values()]
    return sum(share >= _SEEN for share in shares) - _HIDDEN * sum(
        max(0.0, share - _LARGEST) for share in shares
    )
