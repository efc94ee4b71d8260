"""Scenes of a simulator: pictures of them, and recording them for machines without Unity."""

from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError
from infthor_eval.formats.floor_plans import write_floor_plan
from infthor_eval.thor.room_view import find_room_view
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, Vector, teleport_call


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
