"""Check generated trajectories with final tasks by replaying them in a new simulator.

python benchmarks/replayed_trajectories.py --data FOLDER [--procedural 20] [--recorded 20] [--count
100]
    [--min-steps 300] [--min-subgoals 10] [--out FOLDER]

It runs the commands `generate --test-set` and `replay`. A trajectory is correct if the replay
accepts every action, the object log is the same in every step, and the types of its final task were
seen at both ends of the log. The same command with the same --out resumes.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.formats.floor_plans import floor_plan_names
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import Trajectory, iter_trajectories
from infthor_eval.generation.final_task import violation
from infthor_eval.storage.files import file_name

_ROOMS = ("kitchen", "living-room", "bedroom")
_BATHROOMS = range(401, 431)


def main() -> None:
    """Generate, replay, check, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with recorded floor plans")
    parser.add_argument("--procedural", type=int, default=20, help="procedural scenes")
    parser.add_argument("--recorded", type=int, default=20, help="recorded floor plans")
    parser.add_argument("--count", type=int, default=100, help="trajectories")
    parser.add_argument("--min-steps", type=int, default=300)
    parser.add_argument("--min-subgoals", type=int, default=10)
    parser.add_argument("--out", type=Path, help="folder of the results; default: temporary")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        scenes = procedural_scenes(options.procedural) + recorded_scenes(
            options.data, options.recorded
        )
        generated = generate_all(scenes, options, out / "trajectories")
        command = [
            "replay",
            out / "trajectories",
            "--data",
            options.data,
            "--out",
            out / "set",
            "--json",
        ]
        replayed = run(command)
        trajectories = list(iter_trajectories(out / "trajectories"))
        same = sum(
            has_same_log(item, out / "set" / "metadata" / file_name(item.traj_id))
            for item in trajectories
        )
    show(generated, replayed, trajectories, same)


def procedural_scenes(number: int) -> list[str]:
    """Return the names of this many procedural scenes, alternating between room types."""
    return [f"{_ROOMS[index % len(_ROOMS)]}-{1 + index // len(_ROOMS)}" for index in range(number)]


def recorded_scenes(data: Path, number: int) -> list[str]:
    """Return the names of this many recorded floor plans without bathrooms, evenly spaced among
    all."""
    names = [
        name
        for name in floor_plan_names(data)
        if int(name.removeprefix("FloorPlan")) not in _BATHROOMS
    ]
    return [names[index * len(names) // number] for index in range(number)]


def generate_all(scenes: list[str], options: argparse.Namespace, out: Path) -> dict[str, Any]:
    """Generate the trajectories, with as many seeds per scene as are needed."""
    per_scene, more = divmod(options.count, len(scenes))
    total: dict[str, Any] = {"failures": []}
    for names, count in ((scenes[:more], per_scene + 1), (scenes[more:], per_scene)):
        if not names or not count:
            continue
        words = [word for name in names for word in ("--scene", name)]
        words += [
            "--min-steps",
            str(options.min_steps),
            "--min-subgoals",
            str(options.min_subgoals),
        ]
        words += ["--count", str(count), "--test-set", "--data", options.data]
        document = run(["generate", *words, "--out", out, "--json"])
        total["failures"] += document["failures"]
    return total


def run(arguments: list[Any]) -> dict[str, Any]:
    """Return what a command prints with --json."""
    command = [str(Path(sys.executable).with_name("infthor-eval")), *map(str, arguments)]
    result = subprocess.run(command, stdout=subprocess.PIPE, check=False)
    if not result.stdout:
        raise SystemExit(f"{' '.join(command)}: ended with {result.returncode} and printed nothing")
    document: dict[str, Any] = json.loads(result.stdout)
    return document


def has_same_log(trajectory: Trajectory, folder: Path) -> bool:
    """Return True if replay and generation have the same log in every step."""
    logged = [
        {key: value for key, value in entry.items() if key != "step"}
        for entry in trajectory.object_log
    ]
    return logged == [msgspec.to_builtins(step.object_log) for step in read_steps(folder)]


def show(
    generated: dict[str, Any], replayed: dict[str, Any], trajectories: list[Trajectory], same: int
) -> None:
    """Print the counts."""
    tried, accepted = Counter[str](), Counter[str]()
    for item in trajectories:
        tried.update((item.gen_info or {})["tried"])
        accepted.update((item.gen_info or {})["accepted"])
    print(f"{'task type':45} {'tried':>6} {'accepted':>9} {'retries':>8}")
    for name in sorted(tried):
        print(f"{name:45} {tried[name]:6} {accepted[name]:9} {tried[name] - accepted[name]:8}")
    steps = [len(item.plan.low_actions) for item in trajectories]
    broken = [problem for item in trajectories if (problem := violation(item))]
    print(
        f"generated: {len(trajectories)}, {len({item.scene.floor_plan for item in trajectories})} "
        "scenes; ",
        end="",
    )
    print(
        f"{min(steps)} to {max(steps)} steps, {sum(steps)} together; not generated: "
        f"{len(generated['failures'])}"
    )
    print(
        f"replayed without a refused action: {replayed['whole']} of {len(trajectories)}; same "
        f"object log: {same}"
    )
    print(
        f"final tasks that satisfy the rule of both ends: {len(trajectories) - len(broken)} of "
        f"{len(trajectories)}"
    )
    for line in [
        *generated["failures"],
        *broken,
        *map(str, replayed["diverged"]),
        *map(str, replayed["failures"]),
    ]:
        print(f"  {line}")


if __name__ == "__main__":
    main()
