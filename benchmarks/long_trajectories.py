"""Are long trajectories made? Generate many, and print how many were made, what was tried, and what a step costs.

python benchmarks/long_trajectories.py [GROUP ...] [--data FOLDER] [--workers 2] [--out FOLDER]

The groups are those of the table in benchmarks/README.md; without any, all are run (two hours of one core). The same
command with the same --out resumes. Exit code 1 if a trajectory was not made.
"""

import argparse
import resource
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.formats.floor_plans import floor_plan_names
from infthor_eval.generation.generate_set import generate_with_workers
from infthor_eval.generation.jobs import without_bathrooms
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings

_ROOMS = ("kitchen", "living-room", "bedroom", "bathroom")
_RECORDED = 12


@dataclass(frozen=True)
class Group:
    """Trajectories of one row of the table; the seed of a scene is its number unless given."""

    scenes: tuple[str, ...]
    min_steps: int
    min_subgoals: int = 10
    seed: int | None = None
    is_test_set: bool = False

    def jobs(self) -> Iterator[TrajectorySettings]:
        """Yield the settings of its trajectories."""
        for scene in self.scenes:
            number = int("".join(filter(str.isdigit, scene)))
            seed = number if self.seed is None else self.seed
            yield TrajectorySettings(scene, seed, self.min_steps, self.min_subgoals, self.is_test_set)


def groups(data: Path | None) -> dict[str, Group]:
    """Return the groups by name; the recorded floor plans need a folder."""
    made = {
        "1000": Group(_scenes(range(901, 911)), 1000),
        "500": Group(_scenes(range(801, 805)), 500, 5),
        "1600": Group(tuple(f"kitchen-{number}" for number in range(3, 8)), 1600),
        "2300": Group(("kitchen-7",), 2300, 34, seed=11),
        "5000": Group(_scenes((12, 13)), 5000),
    }
    if data is not None:
        names, _ = without_bathrooms(floor_plan_names(data))
        spread = tuple(names[index * len(names) // _RECORDED] for index in range(_RECORDED))
        made["recorded"] = Group(spread, 600, is_test_set=True)
    return made


def _scenes(numbers: range | tuple[int, ...]) -> tuple[str, ...]:
    return tuple(f"{room}-{number}" for room in _ROOMS for number in numbers)


def main() -> int:
    """Generate the groups and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("groups", nargs="*")
    parser.add_argument("--data", type=Path, help="folder with recorded floor plans")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, help="folder of the trajectories; default: temporary")
    options = parser.parse_args()
    known = groups(options.data)
    unknown = set(options.groups) - known.keys()
    if unknown:
        parser.error(f"unknown group {', '.join(sorted(unknown))}; give some of {', '.join(known)}")
    columns = (
        "made",
        "tries",
        "steps",
        "tried",
        "accepted",
        "share",
        "unexecuted",
        "dead ends",
        "pool again",
        "CPU ms/step",
    )
    print(f"{'group':10}" + "".join(f"{column:>12}" for column in columns), flush=True)
    complete = True
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.groups or known:
            complete &= run(name, known[name], options.data, (options.out or Path(scratch)) / name, options.workers)
    return 0 if complete else 1


def run(name: str, group: Group, data: Path | None, out: Path, workers: int) -> bool:
    """Generate one group and print its line, and why trajectories were not made; returns True if all were."""
    jobs = list(group.jobs())
    before = processor_seconds()
    launch = embedded_launch(data if group.is_test_set else None)
    made = generate_with_workers(jobs, launch, out, WorkerSettings(workers))
    summary = made.summary()
    tried = sum(counts.tried for counts in summary.tasks.values())
    accepted = sum(counts.accepted for counts in summary.tasks.values())
    share = f"{accepted / tried:.1%}" if tried else "-"
    per_step = f"{1000 * (processor_seconds() - before) / summary.steps:.1f}" if not summary.resumed else "-"
    numbers = (len(made.paths), len(jobs), summary.steps, tried, accepted, share)
    n_not_executed = sum(summary.not_executed.values())
    cells = (*numbers, n_not_executed, len(summary.roll_backs), summary.pool_restarts, per_step)
    print(f"{name:10}" + "".join(f"{cell!s:>12}" for cell in cells), flush=True)
    for failure in made.failures:
        print(f"  not made: {failure}", flush=True)
    return not made.failures


def processor_seconds() -> float:
    """Return the processor time so far of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(item.ru_utime + item.ru_stime for item in used)


if __name__ == "__main__":
    sys.exit(main())
