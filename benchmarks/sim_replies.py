"""Digest what the simulator answers to a fixed script of actions, to see that a change of its code
changes no reply.

    python benchmarks/sim_replies.py [--steps 2000] [--against CHECKOUT]

The script is a walk through four procedural rooms, one of each kind, with views up and down, doors,
drawers, pick-ups, puts, switches, slices, crouching and teleports, drawn from a fixed seed by what
the agent sees; replies have RGB, depth and instance masks. It prints one digest of all metadata and
one of all pixels for each room, and how many actions succeeded. With --against it compares them
with those of another checkout; exit code 1 if one differs.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

_ROOMS = ("kitchen-21", "living-room-22", "bedroom-23", "bathroom-24")
_WALK = (
    "MoveAhead",
    "RotateRight",
    "MoveAhead",
    "RotateLeft",
    "MoveRight",
    "LookDown",
    "MoveBack",
    "LookUp",
    "Pass",
)


def next_action(
    step: int, objects: list[dict[str, Any]], random: np.random.Generator
) -> dict[str, Any]:
    """Return the next action of the script, by what is in view."""
    if step % 3:
        return {"action": str(random.choice(_WALK))}
    seen = [o for o in objects if o["visible"]]
    held = any(o["isPickedUp"] for o in objects)
    choices: list[dict[str, Any]] = [
        {"action": str(random.choice(("Crouch", "Stand", "RotateRight", "RotateLeft")))}
    ]
    for item in seen:
        name = {"objectId": item["objectId"], "forceAction": bool(random.random() < 0.3)}
        if item["openable"]:
            choices.append({"action": "CloseObject" if item["isOpen"] else "OpenObject", **name})
        if item["toggleable"]:
            choices.append(
                {"action": "ToggleObjectOff" if item["isToggled"] else "ToggleObjectOn", **name}
            )
        if item["sliceable"] and random.random() < 0.2:
            choices.append({"action": "SliceObject", **name})
        if held and item["receptacle"]:
            choices += [{"action": "PutObject", **name, "placeStationary": True}] * 2
        elif item["pickupable"] and not held:
            choices += [{"action": "PickupObject", **name}] * 3
    return choices[int(random.integers(len(choices)))]


def digests(steps: int) -> dict[str, Any]:
    """Return the digests of each room and the number of actions by name and success."""
    import msgpack

    from infthor_sim.player.fifo import FieldType
    from infthor_sim.player.server import SimulatorServer
    from infthor_sim.scenes.catalogue import Catalogue
    from infthor_sim.simulation import Simulation

    result: dict[str, Any] = {}
    done = Counter[str]()
    for room in _ROOMS:
        server, random = SimulatorServer(Simulation(Catalogue())), np.random.default_rng(7)
        server.run({"action": "Reset", "sceneName": room})
        init = {
            "gridSize": 0.25,
            "visibilityDistance": 1.5,
            "fieldOfView": 60,
            "fastActionEmit": False,
        }
        images = {"renderInstanceSegmentation": True, "renderDepthImage": True}
        replies = list(server.answer({"action": "Initialize", **init, **images}))
        metadata, pixels = hashlib.sha256(), hashlib.sha256()
        for step in range(steps // len(_ROOMS)):
            event = msgpack.unpackb(bytes(dict(replies)[FieldType.METADATA]))["agents"][0]
            action = next_action(step, event["objects"], random)
            replies = list(server.answer({**action, "sequenceId": step}))
            for field_type, body in replies:
                (metadata if field_type == FieldType.METADATA else pixels).update(body)
            outcome = msgpack.unpackb(bytes(dict(replies)[FieldType.METADATA]))["agents"][0]
            done[f"{action['action']} {'done' if outcome['lastActionSuccess'] else 'refused'}"] += 1
        result[room] = {"metadata": metadata.hexdigest()[:16], "pixels": pixels.hexdigest()[:16]}
    return {**result, "actions": dict(done)}


def main() -> None:
    """Parse the arguments and print the digests."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument(
        "--against", metavar="CHECKOUT", help="compare with the replies of another checkout"
    )
    options = parser.parse_args()
    ours = digests(options.steps)
    print(json.dumps(ours, indent=1))
    if options.against:
        command = [sys.executable, __file__, "--steps", str(options.steps)]
        environment = {**os.environ, "PYTHONPATH": str(Path(options.against).resolve())}
        other = json.loads(
            subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE).stdout
        )
        print("equal" if ours == other else f"differs: {json.dumps(other, indent=1)}")
        sys.exit(ours != other)


if __name__ == "__main__":
    main()
