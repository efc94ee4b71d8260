"""Restoring in rounds, as in Unity: the published calls, and objects that drift."""

import gzip
import json
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import InitAction, ObjectPose, Scene
from infthor_eval.thor.restore import restore, settle
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

from .views import view

GOLDEN = Path(__file__).parents[1] / "goldens" / "settling.jsonl.gz"
CASES = [json.loads(line) for line in gzip.decompress(GOLDEN.read_bytes()).splitlines()]
SCENE = "kitchen-3"
# How AI2-THOR 5.x calls what 2.1.0 does.
_MODERN = {"DropHandObject": "DropHeldObject"}


class RecordingSimulator:
    """States of a golden case: after the poses, and after what follows them; notes the calls."""

    def __init__(self, case: dict) -> None:
        self._after = _objects(case["after_poses"])
        self._end = _objects(case["at_end"])
        self._held = tuple(case["held"])
        self.calls: list[dict] = []
        self._set_view(self._after)

    def _set_view(self, objects: list[ThorObject]) -> None:
        self.view = view(*objects, inventory=self._held)

    def step(self, action: str, **arguments):
        self.calls.append({"action": action, **arguments})
        if action == "DropHeldObject":
            self._held = ()
        if action == "PickupObject":
            self._held = (arguments["objectId"],)
        n_set = sum(call["action"] == "SetObjectPoses" for call in self.calls)
        is_late = n_set == 3 and action != "SetObjectPoses"
        self._set_view(self._end if is_late else self._after)
        return self.view


def _objects(entries: list[dict]) -> list[ThorObject]:
    return [
        msgspec.convert({"objectType": entry["objectId"].split("|")[0], **entry}, ThorObject)
        for entry in entries
    ]


def _in_published_form(call: dict) -> dict:
    """A call of ours as the published function makes it in AI2-THOR 2.1.0."""
    action = call["action"]
    if action == "SetObjectPoses":
        return {"action": action}
    if action == "TeleportObject":
        same = {name: call[name] for name in ("action", "objectId", "forceAction")}
        return {**same, **call["position"], "rotation": call["rotation"]["y"]}
    return call


@pytest.mark.parametrize("case", CASES)
def test_the_calls_and_the_deviation_are_the_published_ones(case):
    simulator = RecordingSimulator(case)
    reference = view(*_objects(case["reference"]), inventory=case["reference_held"])
    refused, deviation = settle(simulator, case["poses"], reference)
    expected = [
        call | {"action": _MODERN.get(call["action"], call["action"])} for call in case["calls"]
    ]
    for call in expected:
        call.pop("forceVisible", None)  # not an argument of 5.x
    assert [_in_published_form(call) for call in simulator.calls] == expected
    for call in simulator.calls:
        if call["action"] == "SetObjectPoses":
            assert call["objectPoses"] == case["poses"] and call["placeStationary"]
    found = None if deviation is None else [deviation.name, f"{deviation.metres:.3f}"]
    assert found == case["deviation"]
    assert not refused


class DriftingSimulator:
    """An embedded simulator in which placed objects drift, and furniture is pushed.

    Args:
        simulator: the embedded simulator.
        drifts: metres by which all loose objects are off after each setting of poses.
    """

    label = "unity"

    def __init__(self, simulator: Simulator, drifts: list[float]) -> None:
        self._simulator = simulator
        self._drifts = iter(drifts)
        self.actions: list[str] = []
        self.pushed: str | None = None

    @property
    def view(self):
        return self._simulator.view

    def reset(self, scene: str):
        return self._simulator.reset(scene)

    def step(self, action: str, **arguments):
        self.actions.append(action)
        reply = self._simulator.step(action, **arguments)
        if action == "SetObjectPoses":
            self._drift(next(self._drifts))
        if action == "SetObjectPoses" and self.pushed is None:
            self.pushed = self._push_furniture()
        return replace(self._simulator.view, success=reply.success, error=reply.error)

    def _drift(self, metres: float) -> None:
        for key, obj in list(self._simulator.view.objects.items()):
            if metres and obj.pickupable:
                at = asdict(obj.position)
                self._teleport(key, {**at, "y": at["y"] + metres}, obj)

    def _push_furniture(self) -> str:
        piece = next(
            obj
            for obj in self._simulator.view.objects.values()
            if obj.moveable and not obj.pickupable and not obj.receptacle_object_ids
        )
        at = asdict(piece.position)
        self._teleport(piece.object_id, {**at, "x": at["x"] + 0.06}, piece)
        return piece.object_id

    def _teleport(self, key: str, position: dict, obj: ThorObject) -> None:
        pose = {"position": position, "rotation": asdict(obj.rotation)}
        forced = {"forceAction": True, "forceKinematic": True}
        reply = self._simulator.step("TeleportObject", objectId=key, **pose, **forced)
        assert reply.success, reply.error


def _recorded_scene(simulator: Simulator) -> Scene:
    """The scene as it is loaded, in the form of trajectories."""
    loaded = simulator.reset(SCENE)
    at = loaded.agent
    return Scene(
        SCENE,
        InitAction(at.position.x, at.position.y, at.position.z, at.rotation, at.horizon),
        object_poses=[
            ObjectPose(obj.name, asdict(obj.position), asdict(obj.rotation))
            for obj in loaded.objects.values()
            if obj.pickupable
        ],
    )


def _places(simulator: Simulator) -> dict[str, tuple[float, float, float]]:
    objects = simulator.view.objects.values()
    return {obj.name: (obj.position.x, obj.position.y, obj.position.z) for obj in objects}


def test_what_drifts_less_each_time_is_where_it_was_recorded(simulator):
    scene = _recorded_scene(simulator)
    recorded = _places(simulator)
    drifting = DriftingSimulator(simulator, [0.1, 0.03, 0.005])
    report = restore(drifting, scene)
    assert report.lines() == []
    places = _places(simulator)
    apart = {name: max(map(abs, _minus(places[name], recorded[name]))) for name in recorded}
    assert max(apart.values()) <= 0.006
    rounds = ["SetObjectPoses", "Pass", "Pass", "Pass"] * 2
    assert drifting.actions == ["TeleportFull", *rounds, "SetObjectPoses", "TeleportObject"]
    assert drifting.pushed is not None


def test_what_does_not_stay_is_reported(simulator):
    scene = _recorded_scene(simulator)
    report = restore(DriftingSimulator(simulator, [0.1, 0.1, 0.1]), scene)
    assert report.deviation.metres == pytest.approx(0.1, abs=1e-3)
    (line,) = report.lines()
    assert line == f"{report.deviation.name} is off by 0.100 m"


def test_the_embedded_simulator_is_restored_at_once(simulator):
    """One setting of the poses, then the agent, as before."""
    scene = _recorded_scene(simulator)
    calls = []
    step = simulator.step

    def note(action, **arguments):
        calls.append(action)
        return step(action, **arguments)

    simulator.step = note
    try:
        assert restore(simulator, scene).lines() == []
    finally:
        del simulator.step
    assert calls == ["SetObjectPoses", "TeleportFull"]


def test_the_hand_gets_what_the_reference_holds(simulator):
    scene = _recorded_scene(simulator)
    poses = [
        {"objectName": pose.name, "position": pose.position, "rotation": pose.rotation}
        for pose in scene.object_poses
    ]
    simulator.step("SetObjectPoses", objectPoses=poses, placeStationary=True)
    loaded = simulator.view
    first, second = [key for key, obj in loaded.objects.items() if obj.pickupable][:2]
    assert simulator.step("PickupObject", objectId=first, forceAction=True).success
    refused, _ = settle(simulator, poses, replace(loaded, inventory=(second,)))
    assert simulator.view.inventory == (second,) and not refused
    refused, deviation = settle(simulator, poses, replace(loaded, inventory=()))
    assert simulator.view.inventory == () and not refused and deviation is None


def test_what_is_refused_is_reported(simulator):
    loaded = simulator.reset(SCENE)
    gone = replace(loaded, inventory=("Unicorn|+00.00|+00.00|+00.00",))
    refused, _ = settle(simulator, [], gone)
    assert len(refused) == 1 and refused[0].startswith("PickupObject: ")


def _minus(one, other):
    return [a - b for a, b in zip(one, other, strict=True)]
