"""Restoring the recorded initial state of a trajectory.

The order is ALFRED's: toggles, dirt and liquids, object poses, then the agent. In Unity, the agent
comes before the poses, which are set in rounds (`settling.py`), as in the published generator. At
the end come states of single objects, which are ours. Recorded poses have names of Unity objects,
which differ between AI2-THOR versions. An unknown name is replaced by that of an object of the same
type.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

from infthor_eval.formats.object_ids import modern_type
from infthor_eval.formats.trajectory import ObjectPose, Scene, StartState
from infthor_eval.thor.axes import modern_rotation
from infthor_eval.thor.settling import Deviation, poses_call, settle
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, Vector, teleport_call


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
    deviation: Deviation | None = None

    def lines(self) -> list[str]:
        """Return what could not be restored, in words."""
        lines = [f"no {name} here" for name in self.dropped] + self.refused
        if self.deviation is not None:
            lines.append(f"{self.deviation.name} is off by {self.deviation.metres:.3f} m")
        return lines


def restore(simulator: Simulator, scene: Scene) -> RestoreReport:
    """Reset a simulator to the scene of a trajectory, and restore the recorded initial state.

    Raises:
        SimulatorError: the simulator has no such scene, or fails.
    """
    loaded = simulator.reset(scene.house or scene.floor_plan)
    report = RestoreReport()
    calls = _state_calls(scene)
    start = scene.init_action
    pose = AgentPose(Vector(start.x, start.y, start.z), start.yaw, start.horizon)
    poses, report.dropped = _poses(scene.object_poses, loaded)
    settles = simulator.label == "unity" and bool(scene.object_poses)
    if scene.object_poses and not settles:
        calls.append(poses_call(poses))
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
        name = pose.name.removesuffix("(Clone)")
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
