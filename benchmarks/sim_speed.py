"""Measure the speed of the embedded simulator through the real Controller, and of the transport
alone.

    python benchmarks/sim_speed.py [--scene kitchen-1] [--steps 600] [--against CHECKOUT]

It prints one JSON object: steps per second with RGB, with RGB, ids and depth, and of a process that
answers every action with one prepared reply of the same size ("transport"); seconds from start to
first frame; megabytes of the simulator's process at the start and at the end. The frames are
300x300.

With --against it compares this simulator with that of another checkout, in alternation: steps per
second (median of eight rounds) and processor milliseconds per step, with and without smooth edges.
"""

import argparse
import json
import os
import shlex
import statistics
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import Any

_MOVES = (
    "RotateRight",
    "MoveAhead",
    "MoveAhead",
    "LookDown",
    "MoveLeft",
    "LookUp",
    "RotateLeft",
    "MoveBack",
    "Pass",
)
_FULL = {"renderInstanceSegmentation": True, "renderDepthImage": True}


def controller(command: str, scene: str, **init: Any) -> Any:
    """Return a Controller of the simulator that `command` starts."""
    from ai2thor.controller import Controller

    return Controller(
        local_executable_path=command, x_display="0", scene=scene, gridSize=0.25,
        visibilityDistance=1.5,
        fieldOfView=60, server_timeout=60.0, **init,
    )  # fmt: skip


def rate(client: Any, steps: int) -> float:
    """Return the steps per second of a fixed sequence of moves."""
    for index in range(20):
        client.step(_MOVES[index % len(_MOVES)])
    start = time.perf_counter()
    for index in range(steps):
        client.step(_MOVES[index % len(_MOVES)])
    return steps / (time.perf_counter() - start)


def memory(client: Any) -> float:
    """Return the resident megabytes of the simulator."""
    status = Path(f"/proc/{client.server.unity_proc.pid}/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def echo(scene: str, full: bool) -> None:
    """Answer every action with one prepared reply, to measure transport and client alone."""
    from infthor_sim.player.fifo import FifoPipes
    from infthor_sim.player.server import SimulatorServer
    from infthor_sim.scenes.catalogue import Catalogue
    from infthor_sim.simulation import Simulation

    peer = SimulatorServer(Simulation(Catalogue()))
    peer.run({"action": "Reset", "sceneName": scene})
    peer.run({"action": "Initialize", "fieldOfView": 60, **(_FULL if full else {})})
    replies = {n: list(peer.answer({"action": "Pass", "sequenceId": n})) for n in (0, 1)}
    head, metadata = replies[1][0]
    marker = b"\xaasequenceId\x01"
    assert bytes(metadata).count(marker) == 1
    server, client = (
        Path(os.environ[f"AI2THOR_FIFO_{side}_PIPE_PATH"]) for side in ("SERVER", "CLIENT")
    )
    with closing(FifoPipes(server, client, os.getppid())) as pipes:
        pipes.send(replies[0])
        while (message := pipes.receive()) is not None:
            if message["action"] in {"GetScenesInBuild", "Initialize"}:
                pipes.send(peer.answer(message))
                continue
            number = marker[:-1] + b"\xce" + int(message["sequenceId"]).to_bytes(4, "big")
            pipes.send([(head, bytes(metadata).replace(marker, number)), *replies[1][1:]])


def measure(scene: str, steps: int) -> dict[str, Any]:
    """Return all numbers, see the module's docstring."""
    python = shlex.quote(sys.executable)
    result: dict[str, Any] = {"scene": scene, "steps": steps}
    for name, init in (("rgb", {}), ("rgb_ids_depth", _FULL)):
        start = time.perf_counter()
        client = controller(f"{python} -m infthor_sim.player", scene, **init)
        result[f"{name}_seconds_to_first_frame"] = round(time.perf_counter() - start, 2)
        result["objects"] = len(client.last_event.metadata["objects"])
        result[f"{name}_megabytes_at_start"] = round(memory(client), 1)
        result[f"{name}_steps_per_second"] = round(rate(client, steps), 1)
        result[f"{name}_megabytes_at_end"] = round(memory(client), 1)
        client.stop()
        load = "full" if init else "rgb"
        client = controller(
            f"{python} {shlex.quote(__file__)} --echo {load} --scene {scene}", scene, **init
        )
        result[f"{name}_transport_steps_per_second"] = round(rate(client, steps), 1)
        client.stop()
    return result


def processor_time(client: Any) -> float:
    """Return the processor milliseconds of the simulator so far."""
    status = Path(f"/proc/{client.server.unity_proc.pid}/stat").read_text(encoding="ascii")
    ticks = status.rpartition(")")[2].split()[11:13]
    return sum(map(int, ticks)) * 1000 / os.sysconf("SC_CLK_TCK")


def compare(scene: str, steps: int, other: str) -> dict[str, Any]:
    """Compare this simulator with that of another checkout, see the module's docstring."""
    python, here = shlex.quote(sys.executable), str(Path(__file__).parents[1])
    os.environ["PYTHONSAFEPATH"] = (
        "1"  # else the folder that this is run in would come before PYTHONPATH
    )
    result: dict[str, Any] = {"scene": scene, "rounds": 8}
    for load, init in (("rgb", {}), ("rgb_ids_depth", _FULL)):
        clients = {}
        for name, root, more in (
            ("other", other, {}),
            ("ours", here, {}),
            ("ours_low", here, {"quality": "Low"}),
        ):
            os.environ["PYTHONPATH"] = root
            clients[name] = controller(f"{python} -m infthor_sim.player", scene, **init, **more)
        before = {name: processor_time(client) for name, client in clients.items()}
        rates = [
            {name: rate(client, steps // 8) for name, client in clients.items()} for _ in range(8)
        ]
        n_steps = 8 * (steps // 8 + 20)
        result[load] = {
            name: {
                "steps_per_second": round(
                    statistics.median(round_rates[name] for round_rates in rates), 1
                ),
                "processor_ms_a_step": round((processor_time(client) - before[name]) / n_steps, 2),
            }
            for name, client in clients.items()
        }
        for client in clients.values():
            client.stop()
    return result


def main() -> None:
    """Parse the arguments and print the numbers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="kitchen-1")
    parser.add_argument("--steps", type=int, default=600)
    parser.add_argument(
        "--against", metavar="CHECKOUT", help="compare with the simulator of another checkout"
    )
    parser.add_argument("--echo", choices=("rgb", "full"), help=argparse.SUPPRESS)
    options, _ = parser.parse_known_args()
    if options.echo:
        echo(options.scene, options.echo == "full")
        return
    with tempfile.TemporaryDirectory() as home:
        os.environ["HOME"] = home  # ai2thor writes logs below HOME and prunes what it finds there
        result = (
            compare(options.scene, options.steps, str(Path(options.against).resolve()))
            if options.against
            else measure(options.scene, options.steps)
        )
        print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
