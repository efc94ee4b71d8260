"""What the yardsticks of plans earn on long trajectories: the expert, chance, the plan's words, and habit.

    python benchmarks/plans.py --trajectories DIR --data FOLDER [--count 40] [--alfred 20] [--out FOLDER]

Takes so many generated trajectories of at least --min-steps steps, evenly out of all in DIR, and the first ALFRED
demonstrations (FOLDER/alfred/valid_seen.jsonl.gz) that replay whole, and runs planner, random, scripted and history on
each of the two through the command line. planner is to carry out every plan and earn the most there is; random is to
stay under a tenth of it. What planner does not is told plan by plan. Stopped and started again with the same --out it
goes on.
"""

import argparse
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from infthor_eval.episodes.simulators import Simulators
from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import TrajectorySource, iter_sources
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.expert import ExpertRefusedError
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.suite import PlansSuite
from infthor_eval.plans.summary import PlanTaskSummary
from infthor_eval.rates import Rate
from infthor_eval.runs import UnitRecord, read_run

_BASELINES = ("planner", "random", "scripted", "history")
_TASK = "infthor_plans"
_SMALL = 1e-4  # of rewards
Record = UnitRecord[PlanRecord]


class Run(NamedTuple):
    """What came of a baseline."""

    about: PlanTaskSummary
    records: list[Record]


def main() -> None:
    """Choose, run, and print one table."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        runs: dict[str, dict[str, Run]] = {}
        for name, chosen in (("generated", generated(options)), ("ALFRED", demonstrations(options))):
            sources = list(chosen)
            if sources:
                runs[name] = run(sources, options.data, out / name.lower())
        show(runs)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trajectories", type=Path, required=True, help="folder with generated ones")
    parser.add_argument("--data", type=Path, required=True, help="folder with recorded floor plans, and ALFRED's")
    parser.add_argument("--count", type=int, default=40, help="generated trajectories")
    parser.add_argument("--alfred", type=int, default=20, help="demonstrations")
    parser.add_argument("--min-steps", type=int, default=300, help="of a generated trajectory")
    parser.add_argument("--out", type=Path, help="kept there; else in a folder that is removed")
    return parser.parse_args()


def generated(options: argparse.Namespace) -> list[TrajectorySource]:
    """Long trajectories, evenly out of all."""
    found = [source for source in iter_sources(options.trajectories) if is_long(source, options.min_steps)]
    if len(found) < options.count:
        raise SystemExit(f"{options.trajectories} has {len(found)} trajectories of {options.min_steps} steps")
    return [found[index * len(found) // options.count] for index in range(options.count)]


def is_long(source: TrajectorySource, min_steps: int) -> bool:
    """Whether a trajectory has so many steps."""
    return len(source.read().plan.low_actions) >= min_steps


def demonstrations(options: argparse.Namespace) -> Iterator[TrajectorySource]:
    """The first demonstrations that the simulator carries out whole."""
    wanted = options.alfred
    sources = list(iter_sources(options.data / "alfred" / "valid_seen.jsonl.gz")) if wanted else []
    trajectories = [source.read() for source in sources]
    with closing(Simulators("embedded", options.data, trajectories, image=False)) as simulators:
        for source in sources:
            if not wanted:
                return
            if is_whole(source, simulators):
                wanted -= 1
                yield source


def is_whole(source: TrajectorySource, simulators: Simulators) -> bool:
    """Whether no action of a demonstration is refused."""
    with simulators.one() as simulator:
        try:
            environment = PlanEnvironment(source.read(), simulator)
            environment.expert_actions(len(environment.plans) - 1)
        except ExpertRefusedError:
            return False
        except DataError as error:
            print(f"left out: {source.place}: {error}", flush=True)
            return False
    return True


def run(sources: Sequence[TrajectorySource], scenes: Path, out: Path) -> dict[str, Run]:
    """Copy trajectories, run the baselines on them, and read their records."""
    data, results = out / "trajectories.jsonl", out / "results"
    out.mkdir(parents=True, exist_ok=True)
    data.write_bytes(b"".join(source.raw.replace(b"\n", b" ").strip() + b"\n" for source in sources))
    arguments = ["--tasks", _TASK, "--data", data, "--scenes", scenes, "--output", results]
    runs = {}
    for name in _BASELINES:
        command = [Path(sys.executable).with_name("infthor-eval"), "run", "--model", name, *arguments]
        ended = subprocess.run(list(map(str, command)), check=False)
        folders = list((results / name).glob(f"{_TASK}-*"))
        if len(folders) != 1:
            raise SystemExit(f"{name} ended with {ended.returncode}, and {results / name} has {len(folders)} runs")
        header, records = read_run(folders[0], PlansSuite.records)
        runs[name] = Run(PlansSuite().summarise(header, records).tasks[_TASK], records)
    return runs


def show(found: dict[str, dict[str, Run]]) -> None:
    """Print the table, and what there is to look into."""
    columns = ("trajectories", "plans", "carried out, %", "reward", "at most", "% of it", "excluded", "failed")
    print(f"\n{'':20}" + "".join(f"{name:>24}" for name in columns))
    for kind, runs in found.items():
        for name, (about, _) in runs.items():
            rates = (about.success["total"], 100), (about.reward, 1), (about.max_reward, 1), (about.reward_share, 100)
            cells = about.n_trajectories, about.n_plans, *(told(rate, factor) for rate, factor in rates)
            cells = *cells, sum(about.excluded.values()), about.n_failed
            print(f"{kind:10} {name:9}" + "".join(f"{cell:>24}" for cell in cells))
    for kind, runs in found.items():
        print(f"\n{kind}: by kind of plan, % of the most that it can earn")
        for name, (_, records) in runs.items():
            print(f"  {name:9} " + ", ".join(by_kind(records)))
        for reason, number in runs["planner"].about.excluded.items():
            print(f"  {number} excluded: {reason}")
        for line in filter(None, map(shortcoming, runs["planner"].records)):
            print(f"  planner: {line}")


def told(rate: Rate | None, factor: float) -> str:
    """A rate with its interval."""
    if rate is None:
        return "-"
    ends = "" if rate.low is None or rate.high is None else f" [{factor * rate.low:.1f}, {factor * rate.high:.1f}]"
    return f"{factor * rate.mean:.1f}{ends}"


def by_kind(records: Iterable[Record]) -> Iterator[str]:
    """What plans of each kind earned of what they can, how many there are, and how many were carried out."""
    kinds: dict[str, list[PlanRecord]] = defaultdict(list)
    for record in records:
        if record.excluded is None:
            kinds[record.payload.kind].append(record.payload)
    for kind, plans in sorted(kinds.items()):
        got, most = sum(plan.reward for plan in plans), sum(plan.max_reward or 0.0 for plan in plans)
        yield f"{kind} {100 * got / most if most else 0:.1f} ({sum(plan.done for plan in plans)} of {len(plans)} done)"


def shortcoming(record: Record) -> str:
    """What the expert did not earn in a plan, and how it ended; empty where it earned the most there is."""
    plan = record.payload
    if record.excluded is not None or (plan.done and abs(plan.reward - (plan.max_reward or 0.0)) < _SMALL):
        return ""
    last = f"{plan.steps[-1].action} ({plan.steps[-1].message or 'carried out'})" if plan.steps else "no action"
    ended = record.failure or plan.ended
    return f"{record.key.id}: {plan.plan}: {plan.reward} of {plan.max_reward}; {ended}; last {last}"


if __name__ == "__main__":
    main()
