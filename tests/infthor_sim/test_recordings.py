"""Expert trajectories recorded in AI2-THOR replay; objects are where the recording saw them."""

import gzip
import json
import math
from collections import Counter
from typing import Any

import numpy as np

from infthor_sim.geometry import euler_matrix, matrix_euler, round_xyz, to_array, yaw_matrix
from infthor_sim.scenes.catalogue import Catalogue

from .conftest import need_data
from .harness import INIT, Bench

EVERY = 4  # of the 251 trajectories of valid_seen: half a minute for all of them
LARGE = {"Fridge", "CounterTop", "Microwave"}
# Degrees about their own vertical axis that AI2-THOR 5 has turned the models of these types by.
TURNS = {
    **dict.fromkeys(
        ("ButterKnife", "Fork", "Knife", "Ladle", "Pen", "Pencil", "Spoon", "SprayBottle"), 90.0
    ),
    "Spatula": 270.0,
}
MOVES = {"MoveAhead", "RotateLeft", "RotateRight", "LookUp", "LookDown"}


def trajectories() -> list[dict[str, Any]]:
    with gzip.open(need_data() / "alfred" / "valid_seen.jsonl.gz", "rt", encoding="utf-8") as file:
        return [json.loads(line) for index, line in enumerate(file) if index % EVERY == 0]


def additions(listed: list[dict[str, Any]]) -> dict[str, Any]:
    """Cells and objects of the trajectories, in the form of a supplement."""
    supplements: dict[str, Any] = {}
    for trajectory in listed:
        start = trajectory["scene"]["init_action"]
        entry = supplements.setdefault(
            trajectory["scene"]["floor_plan"], {"cells": [], "floor_y": start["y"], "objects": []}
        )  # fmt: skip
        x, z, yaw = start["x"], start["z"], start["rotation"]
        entry["cells"].append([x, z])
        for step in trajectory["plan"]["low_actions"]:
            call = step["api_action"]
            yaw += {"RotateRight": 90, "RotateLeft": -90}.get(call["action"], 0)
            if call["action"] == "MoveAhead":
                x = round(x + 0.25 * math.sin(math.radians(yaw)), 4)
                z = round(z + 0.25 * math.cos(math.radians(yaw)), 4)
                entry["cells"].append([x, z])
            if (
                call["action"] not in {"PickupObject", "PutObject", "SliceObject"}
                and "objectId" in call
            ):
                entry["objects"].append(call["objectId"])
            entry["objects"] += [call["receptacleObjectId"]] if "receptacleObjectId" in call else []
    return supplements


def as_call(call: dict[str, Any]) -> dict[str, Any]:
    """A recorded action of AI2-THOR 2.1.0 as one of 5.0.0."""
    name = call["action"]
    if name == "MoveAhead":
        return {"action": name, "moveMagnitude": call["moveMagnitude"], "forceAction": True}
    if name in MOVES:
        return {
            "action": name,
            "forceAction": True,
            **({"degrees": 15} if name.startswith("Look") else {}),
        }
    if name == "PutObject":
        return {"action": name, "objectId": call["receptacleObjectId"], "forceAction": True}
    return {
        "action": name,
        "objectId": call["objectId"],
        "forceAction": bool(call.get("forceVisible")),
    }


def overlap(a: list[int], b: list[int]) -> float:
    width = max(0, min(a[2], b[2]) - max(a[0], b[0]) + 1)
    height = max(0, min(a[3], b[3]) - max(a[1], b[1]) + 1)
    areas = [(c[2] - c[0] + 1) * (c[3] - c[1] + 1) for c in (a, b)]
    return width * height / (sum(areas) - width * height)


def drawn_box(bench: Bench, object_id: str) -> list[int] | None:
    picture = bench.sim.views.agent_view()
    if object_id not in picture.names:
        return None
    mask = picture.instances[::-1] == picture.names.index(object_id)
    if not mask.any():
        return None
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    return [int(columns[0]), int(rows[0]), int(columns[-1]), int(rows[-1])]


def modern(pose: dict[str, Any], known: set[str]) -> dict[str, Any]:
    """A pose of AI2-THOR 2.1.0 as one of 5.0.0; names in both are of objects without change."""
    turn = TURNS.get(pose["objectName"].partition("_")[0])
    if pose["objectName"] in known or turn is None:
        return pose
    turned = euler_matrix(to_array(pose["rotation"])) @ yaw_matrix(turn)
    return {**pose, "rotation": round_xyz(matrix_euler(turned))}


def start(bench: Bench, scene: dict[str, Any]) -> None:
    init = scene["init_action"]
    outcome = bench.server.run({"action": "Reset", "sceneName": scene["floor_plan"]})[0]
    assert not outcome.error, outcome.error
    known = {item.name for item in bench.sim.world.objects.values()}
    poses = [modern(pose, known) for pose in scene["object_poses"]]
    calls: list[dict[str, Any]] = [
        {"action": "Initialize", **INIT},
        {"action": "SetObjectToggles", "objectToggles": scene["object_toggles"]},
        {"action": "SetObjectPoses", "objectPoses": poses},
        {"action": "TeleportFull", "position": {k: init[k] for k in "xyz"},
         "rotation": {"y": init["rotation"]},
         "horizon": init["horizon"], "standing": True, "forceAction": True},
    ]  # fmt: skip
    for call in calls:
        outcome = bench.server.run(call)[0]
        assert not outcome.error, outcome.error


def test_expert_trajectories_replay(tmp_path):
    listed = trajectories()
    path = tmp_path / "supplement.json"
    path.write_text(json.dumps(additions(listed)), encoding="utf-8")
    bench = Bench(Catalogue(need_data(), path), size=300)
    accepted, refused, whole = Counter[str](), Counter[str](), 0
    overlaps: dict[str, list[float]] = {"pickup": [], "large": []}
    for trajectory in listed:
        start(bench, trajectory["scene"])
        before = sum(refused.values())
        for step in trajectory["plan"]["low_actions"]:
            call = as_call(step["api_action"])
            box = step["discrete_action"]["args"].get("bbox")
            object_type = call.get("objectId", "").split("|")[0]
            group = (
                "pickup"
                if call["action"] == "PickupObject"
                else "large"
                if object_type in LARGE
                else ""
            )
            if box and group:
                drawn = drawn_box(bench, call["objectId"])
                overlaps[group].append(0.0 if drawn is None else overlap(box, drawn))
            done = not bench.server.run(call)[0].error
            name = "move" if step["api_action"]["action"] in MOVES else "interaction"
            (accepted if done else refused)[name] += 1
        whole += sum(refused.values()) == before
    shares = {k: accepted[k] / (accepted[k] + refused[k]) for k in accepted}
    assert shares["move"] >= 0.99
    assert shares["interaction"] >= 0.97
    assert whole / len(listed) >= 0.9
    assert np.median(overlaps["pickup"]) >= 0.5
    assert np.median(overlaps["large"]) >= 0.85
