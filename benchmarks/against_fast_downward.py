"""Check that our plans are optimal: compare their length with the cost that Fast Downward finds for
our PDDL.

python benchmarks/against_fast_downward.py --fast-downward PATH/fast-downward.py [--problems 60]
[--seed 0]

Fast Downward is not a dependency: `pip install up-fast-downward` in a separate environment has the
script (`up_fast_downward/downward/fast-downward.py`). It searches with A* and the LM-cut heuristic,
which is optimal.
"""

import argparse
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from infthor_eval.generation.sampling import TaskPool
from infthor_eval.household.pddl import DOMAIN, problem
from infthor_eval.household.planner import plan
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import SymbolicRoom, room_of
from infthor_eval.household.tasks import Task
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

_SCENES = (
    "kitchen-1",
    "kitchen-2",
    "kitchen-3",
    "living-room-1",
    "living-room-2",
    "bedroom-1",
    "bedroom-2",
)


def main() -> None:
    """Plan sampled tasks both ways and print the number of equal costs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fast-downward", type=Path, required=True)
    parser.add_argument("--problems", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    equal = 0
    for number, (task, room) in enumerate(sample_tasks(options.problems, options.seed)):
        ours = len(plan(task, room) or ())
        theirs = optimal_cost(options.fast_downward, problem(task, room, f"p{number}"))
        equal += ours == theirs
        if ours != theirs:
            print(f"  {task}: {ours} against {theirs}")
    print(f"{equal} of {options.problems} plans have the cost that Fast Downward finds")


def sample_tasks(number: int, seed: int) -> Iterator[tuple[Task, SymbolicRoom]]:
    """Yield tasks of all types in the initial rooms that have a plan and are not done yet."""
    rng = random.Random(seed)
    with Simulator(embedded_launch()) as simulator:
        rooms = []
        for scene in _SCENES:
            view = simulator.reset(scene)
            types = {item.object_type for item in view.objects.values()}
            room = room_of(view)
            rooms.append((room, tasks_of(room, types), TaskPool(rng)))
    for index in range(number):
        room, tasks, pool = rooms[index % len(rooms)]
        yield next(task for task in iter(partial(pool.draw, tasks), None) if plan(task, room)), room


def optimal_cost(script: Path, text: str) -> int | None:
    """Return the cost of an optimal plan for a problem, or None if Fast Downward finds none."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "domain.pddl").write_text(DOMAIN)
        (folder / "problem.pddl").write_text(text)
        command = [
            sys.executable,
            script,
            "domain.pddl",
            "problem.pddl",
            "--search",
            "astar(lmcut())",
        ]
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    match = re.search(r"Plan cost: (\d+)", result.stdout)
    return int(match[1]) if match else None


if __name__ == "__main__":
    main()
