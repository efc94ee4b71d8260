"""Measure baselines of arms on the pick-ups and puts of long trajectories, by the sphere's radius
and by the protocol.

    python benchmarks/manipulation.py --trajectories DIR [--data FOLDER] [--episodes 300] [--radii
    0.06,0.5]
        [--protocols default,stand=before,hand=low] [--out DIR]

It takes trajectories evenly spaced in DIR until they have enough pick-ups and puts. It runs
planner-arm, still and random-arm on them with the command line, for each radius and each protocol:
options of `infthor-eval` with their values, joined by +. It prints what stopped planner-arm in
episodes without success. The same command with the same --out resumes.
"""

import argparse
import math
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

from infthor_eval.formats.trajectory import TrajectorySource, iter_sources
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.suite import ManipulationSuite
from infthor_eval.manipulation.trajectories import arm_episodes
from infthor_eval.rates import format_percent
from infthor_eval.runs import UnitRecord, read_run

_BASELINES = ("planner-arm", "still", "random-arm")
_TASKS = {ManipulationKind.PICKUP: "manipulathor_pickup", ManipulationKind.PUT: "manipulathor_put"}
_NAME = re.compile(r"'(\w+?)_\w+'")  # name of an object that blocked an arm; the group is its type


def main() -> None:
    """Choose trajectories, run the baselines, and print the results."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        data = out / "trajectories.jsonl"
        if not data.exists():
            lines = (
                source.raw.replace(b"\n", b" ").strip() + b"\n"
                for source in choose_trajectories(options)
            )
            data.write_bytes(b"".join(lines))
        for radius, protocol in product(options.radii.split(","), options.protocols.split(",")):
            # Baselines but random-arm close their hand themselves, so that --closing would change
            # nothing.
            for name in ("random-arm",) if protocol.startswith("closing=") else _BASELINES:
                show(name, radius, protocol, run(name, radius, protocol, data, out, options))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--trajectories", type=Path, required=True, help="folder of generated trajectories"
    )
    parser.add_argument("--data", type=Path, help="folder of recorded floor plans")
    parser.add_argument(
        "--episodes", type=int, default=300, help="minimum number of episodes of each kind"
    )
    parser.add_argument(
        "--radii", default="0.5", help="radii of the hand's sphere in metres, separated by commas"
    )
    parser.add_argument(
        "--protocols", default="default", help="such as default,stand=before,stand=before+hand=low"
    )
    parser.add_argument("--out", type=Path, help="folder of the results; default: temporary")
    return parser.parse_args()


def choose_trajectories(options: argparse.Namespace) -> Iterator[TrajectorySource]:
    """Yield trajectories, evenly spaced among all, until they have enough episodes of both
    kinds."""
    every = list(iter_sources(options.trajectories))
    counts: Counter[ManipulationKind] = Counter()
    step = max(1, round(len(every) * 0.618))  # the golden ratio spreads them over the scenes
    while math.gcd(step, len(every)) > 1:  # else some would come twice
        step += 1
    for number in range(len(every)):
        source = every[number * step % len(every)]
        counts.update(episode.kind for episode in arm_episodes(source.read()))
        yield source
        if min(counts[kind] for kind in ManipulationKind) >= options.episodes:
            return


def run(
    name: str, radius: str, protocol: str, data: Path, out: Path, options: argparse.Namespace
) -> Path:
    """Run a baseline and return the folder of its run."""
    results = out / f"radius-{radius}" / protocol
    settings = [] if protocol == "default" else [f"--{setting}" for setting in protocol.split("+")]
    scenes = ["--scenes", str(options.data)] if options.data else []
    arguments = [
        "--tasks",
        "manipulathor",
        "--data",
        data,
        "--radius",
        radius,
        *settings,
        "--out",
        results,
        *scenes,
    ]
    command = [Path(sys.executable).with_name("infthor-eval"), "run", "--model", name, *arguments]
    result = subprocess.run(list(map(str, command)), check=False, stdout=subprocess.DEVNULL)
    folders = list((results / name).glob("manipulathor-*"))
    if len(folders) != 1:
        raise SystemExit(
            f"{name} ended with {result.returncode}, and {results / name} has {len(folders)} runs"
        )
    return folders[0]


def show(name: str, radius: str, protocol: str, folder: Path) -> None:
    """Print one line per kind, and what stopped the upper bound."""
    header, records = read_run(folder, ManipulationSuite.records)
    summary = ManipulationSuite().summarise(header, records)
    for kind, task in _TASKS.items():
        about = summary.tasks[task]
        same = [record for record in records if record.task == task and record.excluded is None]
        seconds = sum(record.seconds for record in same)
        steps = sum(len(record.payload.steps) for record in same)
        print(
            f"{name:12} radius {radius:5} {protocol:14} {kind:7} {len(same):4} episodes,"
            f" success {format_percent(about.success):24} in the sphere at the start "
            f"{format_percent(about.inside):24}"
            f" {steps} steps, {seconds / max(1, len(same)):.2f} s"
            f" an episode, {sum(about.excluded.values())} excluded, {about.n_failed} failed",
            flush=True,
        )
        if name == "planner-arm":
            for obstacle, number in count_obstacles(same):
                print(f"    {number} without success: {obstacle}", flush=True)


def count_obstacles(records: Sequence[UnitRecord[ArmRecord]]) -> list[tuple[str, int]]:
    """Count what blocked the arm most in episodes without success."""
    counts: Counter[str] = Counter()
    for record in records:
        payload = record.payload
        if payload.done:
            continue
        blocking = Counter(
            name for step in payload.steps for text in step.refusals for name in _NAME.findall(text)
        )
        most = ", ".join(name for name, _ in blocking.most_common(2)) or "nothing"
        target = (payload.receptacle_id or payload.object_id).split("|")[0]
        counts[f"{payload.kind} {target}: {payload.ended}; blocked by {most}"] += 1
    return counts.most_common()


if __name__ == "__main__":
    main()
