"""Restoring the recorded initial state of a trajectory.

The order is ALFRED's: toggles, dirt and liquids, object poses, then the agent. In Unity, the agent
comes before the poses, which are set in rounds (`settle`), as in the published generator. At the
end come states of single objects, which are ours. Recorded poses have names of Unity objects, which
differ between AI2-THOR versions. An unknown name is replaced by that of an object of the same type.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import asdict, astuple
from numpy.typing import NDArray

from infthor_eval.formats.object_ids import modern_type, name_of_original
from infthor_eval.formats.trajectory import ObjectPose, Scene, StartState
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector, teleport_call

_ROUNDS = 2  # times that physics acts on the poses before they are set for the last time
_PASSES = 3  # actions of doing nothing in which physics acts
_PUSHED = 0.05  # metres from its place at which an object is put back
_TOLERANCE = 0.02  # metres; what is farther from its pose in the end is reported
# Some long objects have other axes in 5.x than in 2.1.0 (ALFRED, the published trajectories): these
# turns about the object's own vertical axis fit the boxes recorded in ALFRED's training set best.
_ACROSS = ("ButterKnife", "Fork", "Knife", "Ladle", "Pen", "Pencil", "Spoon", "SprayBottle")
_TURNS = {**dict.fromkeys(_ACROSS, 90.0), "Spatula": 270.0}  # degrees


class _Deviation(NamedTuple):
    """The object that is farthest from its recorded pose, and how far, metres."""

    name: str
    metres: float


@dataclass
class RestoreReport:
    """What could not be restored.

    Attributes:
        dropped: names of recorded objects for which the scene has no object.
        refused: calls that the simulator refused, with its messages.
        deviation: in Unity, the object farthest from its recorded pose, if it is off by more than
            2 cm.
    """

    dropped: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    deviation: _Deviation | None = None

    def lines(self) -> list[str]:
        """Return what could not be restored, in words."""
        lines = [f"no {name} here" for name in self.dropped] + self.refused
        if self.deviation is not None:
            lines.append(f"{self.deviation.name} is off by {self.deviation.metres:.3f} m")
        return lines


def restore(simulator: Simulator, scene: Scene) -> RestoreReport:
    """Reset a simulator to the scene of a trajectory, and restore the recorded initial state."""
    loaded = simulator.reset(scene.house or scene.floor_plan)
    report = RestoreReport()
    calls = _state_calls(scene)
    start = scene.init_action
    pose = AgentPose(Vector(start.x, start.y, start.z), start.yaw, start.horizon)
    poses, report.dropped = _poses(scene.object_poses, loaded)
    settles = simulator.label == "unity" and bool(scene.object_poses)
    if scene.object_poses and not settles:
        calls.append(_poses_call(poses))
    calls.append(teleport_call(pose))
    for call in calls:
        _step(simulator, call, report)
    if settles:
        refused, report.deviation = settle(simulator, poses, loaded)
        report.refused += refused
    # Ids are those after the poses were set.
    by_name = {obj.name: obj.object_id for obj in simulator.view.objects.values()}
    for state in scene.object_states or ():
        _set_state(simulator, by_name.get(state.name), state, report)
    return report


def _step(simulator: Simulator, call: dict[str, Any], report: RestoreReport) -> None:
    view = simulator.step(**call)
    if not view.success:
        report.refused.append(f"{call['action']}: {view.error}")


def _set_state(
    simulator: Simulator, key: str | None, state: StartState, report: RestoreReport
) -> None:
    """Give one object its state of the start."""
    if key is None:
        report.dropped.append(state.name)
        return
    obj = simulator.view.objects[key]
    if state.is_open is not None and state.is_open != obj.is_open:
        action = "OpenObject" if state.is_open else "CloseObject"
        _step(simulator, {"action": action, "objectId": key, "forceAction": True}, report)
    if state.is_disabled:
        _step(simulator, {"action": "DisableObject", "objectId": key}, report)


def _state_calls(scene: Scene) -> list[dict[str, Any]]:
    calls: list[dict[str, Any]] = []
    if scene.object_toggles:
        toggles = [
            {"objectType": toggle.object_type, "isOn": toggle.is_on}
            for toggle in scene.object_toggles
        ]
        calls.append({"action": "SetObjectToggles", "objectToggles": toggles})
    if scene.dirty_and_empty:
        calls.append(
            {"action": "SetStateOfAllObjects", "StateChange": "CanBeDirty", "forceAction": True}
        )
        calls.append(
            {"action": "SetStateOfAllObjects", "StateChange": "CanBeFilled", "forceAction": False}
        )
    return calls


def _poses(
    recorded: list[ObjectPose], view: SimulatorView
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the poses with this scene's object names, and the recorded names without an object."""
    known = {obj.name for obj in view.objects.values()}
    spare = defaultdict(list)
    for obj in sorted(view.objects.values(), key=lambda obj: obj.name):
        spare[obj.object_type].append(obj.name)
    renamed: dict[str, str] = {}
    poses = []
    dropped = []
    for pose in recorded:
        name = name_of_original(pose.name)  # copies are made anew
        if name not in known and name not in renamed:
            names = spare[_type_of(name, spare)]
            if names:
                # Round-robin, so that two recorded names of one type get two objects if there are
                # two.
                renamed[name] = names[0]
                names.append(names.pop(0))
        target = name if name in known else renamed.get(name)
        if target is None:
            dropped.append(name)
        else:
            # An unknown name is of another AI2-THOR version, so its object may have other axes too.
            turned = (
                modern_rotation(_type_of(name, spare), pose.rotation)
                if name in renamed
                else pose.rotation
            )
            poses.append({"objectName": target, "position": pose.position, "rotation": turned})
    return poses, dropped


def _type_of(name: str, types: dict[str, list[str]]) -> str:
    """Return the object type in a Unity object's name ("Mug_291e6e8a")."""
    head = name.partition("_")[0]
    return head if head in types else modern_type(head)


def modern_rotation(object_type: str, rotation: Mapping[str, float]) -> dict[str, float]:
    """Convert Euler angles of 2.1.0 (Unity's x, y, z, degrees) to those of the same look in 5.x."""
    turn = _TURNS.get(object_type, 0.0)
    if not turn:
        return dict(rotation)
    return _angles(_matrix(rotation) @ _matrix({"x": 0.0, "y": turn, "z": 0.0}))


def _matrix(rotation: Mapping[str, float]) -> NDArray[np.float64]:
    """Return the rotation matrix of Unity's Euler angles: about z first, then x, then y."""
    x, y, z = [math.radians(rotation[axis]) for axis in "xyz"]
    about_x = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    about_y = np.array([[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]])
    about_z = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    product: NDArray[np.float64] = about_y @ about_x @ about_z
    return product


def _angles(matrix: NDArray[np.float64]) -> dict[str, float]:
    x = math.asin(max(-1.0, min(1.0, -matrix[1, 2])))
    if abs(matrix[1, 2]) > 1 - 1e-9:  # gimbal lock: y and z turn about the same axis, so z can be 0
        y = math.atan2(-matrix[2, 0], matrix[0, 0])
        z = 0.0
    else:
        y = math.atan2(matrix[0, 2], matrix[2, 2])
        z = math.atan2(matrix[1, 0], matrix[1, 1])
    return {
        axis: round(math.degrees(angle) % 360, 6)
        for axis, angle in zip("xyz", (x, y, z), strict=True)
    }


def _poses_call(poses: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the call that gives objects their poses, by name."""
    return {"action": "SetObjectPoses", "objectPoses": poses, "placeStationary": True}


def settle(
    simulator: Simulator, poses: Sequence[dict[str, Any]], reference: SimulatorView
) -> tuple[list[str], _Deviation | None]:
    """Give objects their poses until they stay there, and the rest its place of a reference state.

    As the published generator replays since July 2026 (`TrajManager` in `gen/utils/gen_util.py`):
    recorded poses are those of settled objects, so setting them again after physics acted
    converges. Then what cannot be picked up, and was pushed, is put back, and the hand gets what it
    should hold.

    Args:
        simulator: simulator with the scene, the agent at its place.
        poses: entries of `SetObjectPoses`, with names of the scene.
        reference: state with the places of objects that cannot be picked up, and what is held.

    Returns:
        The refused calls with the simulator's messages, and what is off by more than 2 cm.
    """
    refused: list[str] = []

    def run(call: dict[str, Any]) -> None:
        view = simulator.step(**call)
        if not view.success:
            refused.append(f"{call['action']}: {view.error}")

    held = simulator.view.inventory
    if held and held != reference.inventory:
        run({"action": "DropHeldObject", "forceAction": True})
    for _ in range(_ROUNDS):
        run(_poses_call(poses))
        for _ in range(_PASSES):
            run({"action": "Pass"})
    run(_poses_call(poses))
    for call in list(_calls_back(simulator.view, reference)):
        run(call)
    deviation = _deviation(poses, simulator.view)  # before anything is taken from its place
    for key in reference.inventory:
        if key not in simulator.view.inventory:
            run({"action": "PickupObject", "objectId": key, "forceAction": True})
    return refused, deviation


def _calls_back(current: SimulatorView, reference: SimulatorView) -> Iterator[dict[str, Any]]:
    for key, obj in current.objects.items():
        place = reference.objects.get(key)
        if place is None or place.pickupable or place.is_picked_up:
            continue
        if math.dist(astuple(place.position), astuple(obj.position)) > _PUSHED:
            yield {
                "action": "TeleportObject",
                "objectId": key,
                "position": asdict(place.position),
                "rotation": asdict(place.rotation),
                # its own resting place overlaps what it rests on, and would be refused
                "forceAction": True,
            }


def _deviation(poses: Sequence[dict[str, Any]], view: SimulatorView) -> _Deviation | None:
    loose = [obj for obj in view.objects.values() if obj.pickupable]
    deviations = [
        _Deviation(pose["objectName"], min(_distances(pose, loose), default=0.0)) for pose in poses
    ]
    worst = max(deviations, key=lambda found: found.metres, default=None)
    return worst if worst is not None and worst.metres > _TOLERANCE else None


def _distances(pose: dict[str, Any], loose: Sequence[ThorObject]) -> Iterator[float]:
    """Yield the distances of all objects with a pose's name: several may have it."""
    place = [pose["position"][axis] for axis in "xyz"]
    for obj in loose:
        if name_of_original(obj.name) == pose["objectName"]:
            yield math.dist(astuple(obj.position), place)
