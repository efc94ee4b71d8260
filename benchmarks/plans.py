"""Measure the baselines of plans on long trajectories: planner, random, scripted and history.

    python benchmarks/plans.py --trajectories DIR --data FOLDER [--count 40] [--alfred 20] [--out
    FOLDER]

It takes --count generated trajectories of at least --min-steps steps, evenly spaced in DIR, and the
first ALFRED demonstrations (FOLDER/alfred/valid_seen.jsonl.gz) that replay without a refused
action. It runs the baselines on each of these two sets with the command line. planner should
complete every plan with the maximum reward, and random should have less than a tenth of it. The
plans in which planner falls short are printed. The same command with the same --out resumes.
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
_SMALL = 1e-4  # tolerance of rewards
Record = UnitRecord[PlanRecord]


class Run(NamedTuple):
    """Results of a baseline."""

    about: PlanTaskSummary
    records: list[Record]


def main() -> None:
    """Choose trajectories, run the baselines, and print the tables."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        runs: dict[str, dict[str, Run]] = {}
        for name, chosen in (
            ("generated", generated_sources(options)),
            ("ALFRED", demonstrations(options)),
        ):
            sources = list(chosen)
            if sources:
                runs[name] = run(sources, options.data, out / name.lower())
        show(runs)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--trajectories", type=Path, required=True, help="folder of generated trajectories"
    )
    parser.add_argument(
        "--data",
        type=Path,
        required=True,
        help="folder of recorded floor plans and ALFRED's trajectories",
    )
    parser.add_argument("--count", type=int, default=40, help="generated trajectories")
    parser.add_argument("--alfred", type=int, default=20, help="demonstrations")
    parser.add_argument(
        "--min-steps", type=int, default=300, help="minimum steps of a generated trajectory"
    )
    parser.add_argument("--out", type=Path, help="folder of the results; default: temporary")
    return parser.parse_args()


def generated_sources(options: argparse.Namespace) -> list[TrajectorySource]:
    """Return long trajectories, evenly spaced among all."""
    sources = [
        source
        for source in iter_sources(options.trajectories)
        if is_long(source, options.min_steps)
    ]
    if len(sources) < options.count:
        raise SystemExit(
            f"{options.trajectories} has {len(sources)} trajectories of {options.min_steps} steps"
        )
    return [sources[index * len(sources) // options.count] for index in range(options.count)]


def is_long(source: TrajectorySource, min_steps: int) -> bool:
    """Return True if a trajectory has at least this many steps."""
    return len(source.read().plan.low_actions) >= min_steps


def demonstrations(options: argparse.Namespace) -> Iterator[TrajectorySource]:
    """Yield the first demonstrations that the simulator replays without a refused action."""
    remaining = options.alfred
    sources = (
        list(iter_sources(options.data / "alfred" / "valid_seen.jsonl.gz")) if remaining else []
    )
    trajectories = [source.read() for source in sources]
    with closing(Simulators("embedded", options.data, trajectories, image=False)) as simulators:
        for source in sources:
            if not remaining:
                return
            if is_whole(source, simulators):
                remaining -= 1
                yield source


def is_whole(source: TrajectorySource, simulators: Simulators) -> bool:
    """Return True if no action of a demonstration is refused."""
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
    data.write_bytes(
        b"".join(source.raw.replace(b"\n", b" ").strip() + b"\n" for source in sources)
    )
    arguments = ["--tasks", _TASK, "--data", data, "--scenes", scenes, "--out", results]
    runs = {}
    for name in _BASELINES:
        command = [
            Path(sys.executable).with_name("infthor-eval"),
            "run",
            "--model",
            name,
            *arguments,
        ]
        result = subprocess.run(list(map(str, command)), check=False)
        folders = list((results / name).glob(f"{_TASK}-*"))
        if len(folders) != 1:
            raise SystemExit(
                f"{name} ended with {result.returncode}, and {results / name} has {len(folders)} "
                "runs"
            )
        header, records = read_run(folders[0], PlansSuite.records)
        runs[name] = Run(PlansSuite().summarise(header, records).tasks[_TASK], records)
    return runs


def show(results: dict[str, dict[str, Run]]) -> None:
    """Print the table, and the plans in which planner falls short."""
    columns = (
        "trajectories",
        "plans",
        "completed, %",
        "reward",
        "maximum",
        "% of it",
        "excluded",
        "failed",
    )
    print(f"\n{'':20}" + "".join(f"{name:>24}" for name in columns))
    for kind, runs in results.items():
        for name, (about, _) in runs.items():
            rates = (
                (about.success["total"], 100),
                (about.reward, 1),
                (about.max_reward, 1),
                (about.reward_share, 100),
            )
            cells = (
                about.n_trajectories,
                about.n_plans,
                *(format_rate(rate, factor) for rate, factor in rates),
            )
            cells = *cells, sum(about.excluded.values()), about.n_failed
            print(f"{kind:10} {name:9}" + "".join(f"{cell:>24}" for cell in cells))
    for kind, runs in results.items():
        print(f"\n{kind}: by kind of plan, % of the maximum reward")
        for name, (_, records) in runs.items():
            print(f"  {name:9} " + ", ".join(by_kind(records)))
        for reason, number in runs["planner"].about.excluded.items():
            print(f"  {number} excluded: {reason}")
        for line in filter(None, map(shortcoming, runs["planner"].records)):
            print(f"  planner: {line}")


def format_rate(rate: Rate | None, factor: float) -> str:
    """Return a rate with its interval as text."""
    if rate is None:
        return "-"
    ends = (
        ""
        if rate.low is None or rate.high is None
        else f" [{factor * rate.low:.1f}, {factor * rate.high:.1f}]"
    )
    return f"{factor * rate.mean:.1f}{ends}"


def by_kind(records: Iterable[Record]) -> Iterator[str]:
    """Yield the share of the maximum reward, and the number of completed plans, by kind of plan."""
    kinds: dict[str, list[PlanRecord]] = defaultdict(list)
    for record in records:
        if record.excluded is None:
            kinds[record.payload.kind].append(record.payload)
    for kind, plans in sorted(kinds.items()):
        reward, most = (
            sum(plan.reward for plan in plans),
            sum(plan.max_reward or 0.0 for plan in plans),
        )
        n_done = sum(plan.done for plan in plans)
        yield f"{kind} {100 * reward / most if most else 0:.1f} ({n_done} of {len(plans)} done)"


def shortcoming(record: Record) -> str:
    """Return the missing reward of the expert in a plan, and how it ended; empty if none is
    missing."""
    plan = record.payload
    if record.excluded is not None or (
        plan.done and abs(plan.reward - (plan.max_reward or 0.0)) < _SMALL
    ):
        return ""
    last = (
        f"{plan.steps[-1].action} ({plan.steps[-1].message or 'accepted'})"
        if plan.steps
        else "no action"
    )
    ended = record.failure or plan.ended
    return f"{record.key.id}: {plan.plan}: {plan.reward} of {plan.max_reward}; {ended}; last {last}"


if __name__ == "__main__":
    main()
