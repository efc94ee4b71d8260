"""Are long trajectories made? Generate many, and print how many were made, what was tried, and what
a step costs.

python benchmarks/long_trajectories.py [GROUP ...] [--data FOLDER] [--workers 2] [--out FOLDER]
[--json]

The groups are those of the table in benchmarks/generation.md; without any, all are run (two hours
of one core). The same command with the same --out resumes. Exit code 1 if a trajectory was not
made.
"""

import argparse
import json
import resource
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

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
            yield TrajectorySettings(
                scene, seed, self.min_steps, self.min_subgoals, self.is_test_set
            )


def groups(data: Path | None) -> dict[str, Group]:
    """Return the groups by name; the recorded floor plans need a folder."""
    made = {
        "1000": Group(_scenes(range(901, 911)), 1000),
        "500": Group(_scenes(range(801, 805)), 500, 5),
        "1600": Group(tuple(f"kitchen-{number}" for number in range(3, 8)), 1600),
        "2300": Group(("kitchen-7",), 2300, 34, seed=11),
        "5000": Group(_scenes((12, 13)), 5000),
        "vitals": Group(("kitchen-951", "living-room-952", "bedroom-953", "bathroom-954"), 1000),
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
    parser.add_argument("--json", action="store_true", help="print the numbers as one JSON object")
    options = parser.parse_args()
    known = groups(options.data)
    unknown = set(options.groups) - known.keys()
    if unknown:
        parser.error(f"unknown group {', '.join(sorted(unknown))}; give some of {', '.join(known)}")
    rows = []
    if not options.json:
        print(
            f"{'group':10}" + "".join(f"{column:>12}" for column in Row.__annotations__), flush=True
        )
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.groups or known:
            out = (options.out or Path(scratch)) / name
            row, failures = run(known[name], options.data, out, options.workers)
            rows.append(row)
            if not options.json:
                print(f"{name:10}" + "".join(f"{cell!s:>12}" for cell in row), flush=True)
            for failure in failures:
                print(f"  not made: {failure}", file=sys.stderr, flush=True)
    if options.json:
        print(
            json.dumps(
                {
                    name: row._asdict()
                    for name, row in zip(options.groups or known, rows, strict=True)
                }
            )
        )
    return 0 if all(row.made == row.tries for row in rows) else 1


class Row(NamedTuple):
    """The numbers of one group: trajectories, their steps, what became of the tasks, and the cost
    of a step."""

    made: int
    tries: int
    steps: int
    tried: int
    accepted: int
    share: float | None
    unexecuted: int
    dead_ends: int
    pool_again: int
    cpu_ms_step: float | None


def run(group: Group, data: Path | None, out: Path, workers: int) -> tuple[Row, list[str]]:
    """Generate one group; return its numbers, and why trajectories were not made."""
    jobs = list(group.jobs())
    before = processor_seconds()
    launch = embedded_launch(data if group.is_test_set else None)
    made = generate_with_workers(jobs, launch, out, WorkerSettings(workers))
    summary = made.summary()
    tried = sum(counts.tried for counts in summary.tasks.values())
    accepted = sum(counts.accepted for counts in summary.tasks.values())
    is_new = summary.steps > 0 and not summary.resumed
    row = Row(
        made=len(made.paths),
        tries=len(jobs),
        steps=summary.steps,
        tried=tried,
        accepted=accepted,
        share=round(accepted / tried, 4) if tried else None,
        unexecuted=sum(summary.not_executed.values()),
        dead_ends=len(summary.roll_backs),
        pool_again=summary.pool_restarts,
        cpu_ms_step=round(1000 * (processor_seconds() - before) / summary.steps, 1)
        if is_new
        else None,
    )
    return row, [str(failure) for failure in made.failures]


def processor_seconds() -> float:
    """Return the processor time so far of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(item.ru_utime + item.ru_stime for item in used)


if __name__ == "__main__":
    sys.exit(main())
