"""The simulator: messages of a client, houses, recorded floor plans; and its own replies, as its
client reads them."""

import json
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgpack
import msgspec

from infthor_eval.formats.floor_plans import write_floor_plan
from infthor_eval.thor.view import ReceivedObjects, view_of
from infthor_sim.errors import SimulatorError
from infthor_sim.player.fifo import FieldType, parse_action
from infthor_sim.scenes.catalogue import Catalogue

from ...infthor_sim.harness import Bench
from ...infthor_sim.test_houses import house
from ..damage import Form
from ..reader import Reader

__all__ = ["READERS"]

_SCENE = "FloorPlan1"
_SIZE = 20


@cache
def _bench() -> Bench:
    return Bench(size=_SIZE)


def _messages() -> list[dict[str, Any]]:
    bench = _bench()
    bench.reset("kitchen-1")
    mug, table, fridge = (bench.first(name) for name in ("Mug", "CounterTop", "Fridge"))
    pose = {"objectName": bench.object(mug)["name"], "position": {"x": 0.0, "y": 1.0, "z": 0.0}}
    return [
        {"action": "MoveAhead", "moveMagnitude": 0.25, "renderDepthImage": True},
        {"action": "RotateRight", "degrees": 90.0},
        {"action": "TeleportFull", "x": 0.0, "y": 0.9, "z": 0.0, "rotation": {"y": 90.0},
         "horizon": 30,
         "standing": True},
        {"action": "PickupObject", "objectId": mug, "forceAction": True},
        {"action": "PutObject", "objectId": table, "forceAction": True},
        {"action": "OpenObject", "objectId": fridge, "openness": 0.5, "forceAction": True},
        {"action": "SetObjectPoses", "objectPoses": [pose, pose], "placeStationary": True},
        {"action": "SetObjectToggles", "objectToggles": [{"objectType": "Faucet", "isOn": True}]},
        {"action": "SetStateOfAllObjects", "StateChange": "CanBeDirty", "forceAction": True},
        {"action": "GetInteractablePoses", "objectId": fridge, "maxPoses": 2, "horizons": [0.0]},
        {"action": "AddThirdPartyCamera", "position": {"x": 0, "y": 2, "z": 0},
         "rotation": {"x": 90},
         "fieldOfView": 60},
        {"action": "PlaceObjectAtPoint", "objectId": mug,
         "position": {"x": 0.0, "y": 1.0, "z": 0.0}},
        {"action": "InitialRandomSpawn", "randomSeed": 1,
         "numDuplicatesOfType": [{"objectType": "Mug", "count": 2}]},
        {"action": "PushObject", "objectId": mug, "moveMagnitude": 10.0, "pushAngle": "45"},
        {"action": "Initialize", "gridSize": 0.25, "fieldOfView": 60, "visibilityDistance": 1.5},
        {"action": "SaveState", "slot": 0},
        {"action": "RestoreState", "slot": 0, "renderImage": False},
    ]  # fmt: skip


def _make_messages(folder: Path) -> Path:
    (folder / "sent.jsonl").write_text(
        "".join(json.dumps(message) + "\n" for message in _messages())
    )
    return folder / "sent.jsonl"


def _answer(folder: Path) -> None:
    """Send all messages; whatever they are, the simulator lives and can be reset."""
    bench = _bench()
    bench.sim.cameras.clear()
    bench.ok("ChangeResolution", x=_SIZE, y=_SIZE)
    bench.reset("kitchen-1")
    for line in (folder / "sent.jsonl").read_bytes().splitlines():
        try:
            message = parse_action(FieldType.ACTION, line)
        except SimulatorError:
            continue
        bench.server.answer(message)
        if bench.sim.display.width * bench.sim.display.height > 10**6:
            bench.ok("ChangeResolution", x=_SIZE, y=_SIZE)
        del bench.sim.cameras[1:]


def _make(document: Any, folder: Path) -> Path:
    (folder / "a.json").write_text(json.dumps(document))
    return folder / "a.json"


def _build_house(folder: Path) -> None:
    bench = _bench()
    try:
        document = json.loads((folder / "a.json").read_bytes())
    except (ValueError, RecursionError):
        return
    bench.sim.cameras.clear()
    bench.reset("kitchen-1")
    metadata = bench.step("CreateHouse", house=document)
    assert metadata["lastActionSuccess"] or metadata["errorMessage"]
    bench.step("Pass")


def _make_floor_plan(folder: Path) -> Path:
    bench = _bench()
    objects = bench.reset("bathroom-1")["objects"]
    cells = [(round(x, 2), round(z, 2)) for x, z in sorted(bench.sim.world.nav)]
    write_floor_plan(folder, _SCENE, objects[:12], cells)
    return folder / "thor_scenes/objects.jsonl.gz"


def _make_layout(folder: Path) -> Path:
    _make_floor_plan(folder)
    return folder / f"alfred/layouts/{_SCENE}-layout.npy"


def _load(folder: Path) -> None:
    world = Catalogue(folder).load(_SCENE)
    assert len(world.nav) > 0


def _make_supplement(folder: Path) -> Path:
    _make_floor_plan(folder)
    added = {
        "cells": [[0.0, 0.25], [0.25, 0.25]],
        "floor_y": 0.9,
        "objects": ["Fridge|+00.50|+00.00|+01.00", "Sink|a"],
    }
    return _make({_SCENE: added}, folder)


def _load_supplement(folder: Path) -> None:
    Catalogue(folder, folder / "a.json").load(_SCENE)


def _make_metadata(folder: Path) -> Path:
    metadata = dict(_bench().reset("bathroom-1"))
    metadata["objects"] = metadata["objects"][:4]
    return _make(metadata, folder)


def _view(folder: Path) -> None:
    try:
        metadata = json.loads((folder / "a.json").read_bytes())
    except (ValueError, RecursionError):
        return
    if isinstance(metadata, dict):  # else ai2thor's client refuses it before
        if "objects" in metadata:
            try:
                packed = msgpack.packb(metadata["objects"])
            except (ValueError, OverflowError):  # what no message can carry
                return
            metadata["objects"] = ReceivedObjects(msgspec.Raw(packed))
        event = SimpleNamespace(
            third_party_camera_frames=[],
            metadata=metadata,
            frame=None,
            depth_frame=None,
            instance_segmentation_frame=None,
        )
        view_of(event).objects  # noqa: B018


READERS = (
    Reader("action message", Form.JSON_LINES, _make_messages, _answer),
    Reader("house", Form.JSON, partial(_make, house()), _build_house),
    Reader("floor plan objects", Form.PACKED_LINES, _make_floor_plan, _load),
    Reader("floor plan layout", Form.BYTES, _make_layout, _load),
    Reader("supplement", Form.JSON, _make_supplement, _load_supplement),
    Reader("reply of the simulator", Form.JSON, _make_metadata, _view),
)
