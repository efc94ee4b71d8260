"""Measure what the baselines of plans earn under each set of reward rules, as a table for
benchmarks/plans.md.

    python benchmarks/plan_rewards.py [--more FILE] [--scenes FOLDER] [--out FOLDER]

It runs planner, random, scripted and history on the bundled set with the command line, under both
sets of rules; with --more also on another file of trajectories, in recorded floor plans if they are
given. The same command with the same --out resumes.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from infthor_eval.plans.suite import PlansSuite
from infthor_eval.plans.summary import PlanTaskSummary
from infthor_eval.rates import Rate
from infthor_eval.runs import read_run

_RULES = ("default", "published")
_BASELINES = ("planner", "random", "scripted", "history")


def main() -> None:
    """Run the baselines and print the table, sums over trajectories."""
    options = _arguments()
    print(
        "| | rules | plans done | reward | planner's or most | logged total_reward | logged "
        "agent_reward |"
    )
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        for rules in _RULES:
            for name, task in run(
                _BASELINES, rules, out / rules, ["--tasks", "infthor_plans_mini"]
            ):
                print(_row(name, rules, task))
        for rules in _RULES if options.more is not None else ():
            scenes = [] if options.scenes is None else ["--scenes", str(options.scenes)]
            given = ["--tasks", "infthor_plans", "--data", str(options.more), *scenes]
            for name, task in run(_BASELINES, rules, out / f"{rules}-more", given):
                print(_row(f"{options.more.stem}, {name}", rules, task))


def run(
    baselines: Sequence[str], rules: str, out: Path, options: Sequence[str]
) -> Iterator[tuple[str, PlanTaskSummary]]:
    """Run baselines with the command line and yield the results of each."""
    program = str(Path(sys.executable).with_name("infthor-eval"))
    command = [program, "run", "--model", ",".join(baselines), "--rewards", rules]
    subprocess.run([*command, *options, "--out", str(out)], check=True, stdout=subprocess.DEVNULL)
    suite = PlansSuite()
    for name in baselines:
        (folder,) = (out / name).iterdir()
        (task,) = suite.summarise(*read_run(folder, suite.records)).tasks.values()
        yield name, task


def _row(name: str, rules: str, task: PlanTaskSummary) -> str:
    def total(rate: Rate | None) -> str:
        return "-" if rate is None else f"{rate.mean * task.n_trajectories:.1f}"

    done = task.endings.get("done", 0)
    logged = (total(task.logged.get(key)) for key in ("total_reward", "agent_reward"))
    cells = (
        name,
        rules,
        f"{done} of {task.n_plans}",
        total(task.reward),
        total(task.max_reward),
        *logged,
    )
    return f"| {' | '.join(cells)} |"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--more", type=Path, help="further trajectories")
    parser.add_argument("--scenes", type=Path, help="recorded floor plans for them")
    parser.add_argument("--out", type=Path, help="folder of the runs")
    return parser.parse_args()


if __name__ == "__main__":
    main()
