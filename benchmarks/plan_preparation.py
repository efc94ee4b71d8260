"""Measure whether preparing a plan late in a long trajectory takes longer than preparing an early
one.

    python benchmarks/plan_preparation.py [--trajectory FILE] [--plans 1 25 50 100] [--repeats 10]

Unless a trajectory is given, one of 700 steps is generated in kitchen-1 (a minute or two). It is
measured with frames, as for models, and without rendering, as for baselines:
  in order   The environment is reset to each plan and the expert acts in it, as in an evaluation.
             The first reset to a plan also executes the expert's actions before it. The number is
             the median time of a reset over the number of these actions, of the plans of a kind
             that are nearest to number i.
  at random  After that, the environment is reset to plans in random order. The number is
             the median time of resets to the plan of a kind that is nearest to number i.

Times are processor milliseconds of this process and the simulator together, with wall time in
brackets. The last tables have the parts of these times.
"""

import argparse
import random
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

from infthor_eval.formats.trajectory import Trajectory, iter_trajectories
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.navigation import Grid
from infthor_eval.plans import expert, rewards
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.plan import Plan, PlanKind
from infthor_eval.thor import simulator as simulators
from infthor_eval.thor.controller import SafeController
from infthor_eval.thor.frames import FrameFolder, NoFrames
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

Spent = dict[str, float]  # milliseconds by part
_KINDS = (PlanKind.GOTO, PlanKind.PICKUP, PlanKind.PUT)
_PLACES: dict[str, list[tuple[Any, str]]] = {
    "transport": [(SafeController, "step")],
    "decoding": [(simulators, "view_of")],
    "paths": [(Grid, "distances_to")],
    "goals": [(rewards, "goal_holds"), (expert, "goal_holds")],
    "writing": [(FrameFolder, "keep")],
}
_COLUMNS = ("simulator", *_PLACES, "rest", "processor")


def main() -> None:
    """Measure with frames and without, and print."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        trajectory = next(
            iter_trajectories(options.trajectory or generate_trajectory(Path(scratch)))
        )
        print(f"{trajectory.traj_id}: {len(trajectory.plan.low_actions)} steps; milliseconds")
        for seen in (True, False):
            print(f"\n{'with frames' if seen else 'without rendering'}")
            prepare(trajectory, seen, options)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--trajectory", type=Path, help="a trajectory of many plans, in a procedural scene"
    )
    parser.add_argument(
        "--plans", type=int, nargs="+", default=[1, 25, 50, 100], help="numbers of plans, from 0"
    )
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="seed of the random order")
    return parser.parse_args()


def generate_trajectory(out: Path) -> Path:
    """Generate a long trajectory and return its folder."""
    with Simulator(embedded_launch()) as simulator:
        result = generate_set(
            [TrajectorySettings("kitchen-1", 1, 700, 20, max_fail=700)], simulator, out
        )
    if result.failures:
        raise SystemExit(result.failures[0])
    return out


def prepare(trajectory: Trajectory, seen: bool, options: argparse.Namespace) -> None:
    """Measure with or without frames, and print the tables."""
    with (
        Simulator(embedded_launch(), image=seen, instances=False, max_copies=512) as simulator,
        tempfile.TemporaryDirectory() as folder,
        measure_places() as own,
    ):
        environment = PlanEnvironment(
            trajectory, simulator, frames=FrameFolder(Path(folder)) if seen else NoFrames()
        )
        if max(options.plans) >= len(environment.plans):
            raise SystemExit(
                f"there are {len(environment.plans)} plans; give a longer trajectory, or --plans"
            )
        clock = Clock(simulator, own)
        resets, actions = run_episode(environment, clock)
        counts = [plan.low[1] - plan.low[0] for plan in environment.plans]
        by_action = [
            {name: ms / n for name, ms in spent.items()}
            for spent, n in zip(resets, counts, strict=True)
        ]
        places = {
            (kind, i): nearest(environment.plans, kind, i) for kind in _KINDS for i in options.plans
        }
        in_order = {
            key: [by_action[at] for at in indices[: options.repeats]]
            for key, indices in places.items()
        }
        again = reset_at_random(
            environment, clock, {key: indices[0] for key, indices in places.items()}, options
        )
    show("in order, for each of the expert's actions", in_order, options.plans)
    show("at random", again, options.plans)
    show_places(again, actions)


def run_episode(environment: PlanEnvironment, clock: "Clock") -> tuple[list[Spent], list[Spent]]:
    """Run the expert in all plans; returns the times of each reset and of each action."""
    resets, actions = [], []
    for plan in environment.plans:
        resets.append(clock.measure(partial(environment.reset, plan.index))[1])
        over = False
        for action in environment.expert_actions(plan.index):
            if not over:
                outcome, spent = clock.measure(partial(environment.step, action.call))
                actions.append(spent)
                over = outcome.terminated
    return resets, actions


def reset_at_random(
    environment: PlanEnvironment, clock: "Clock", plans: dict[Any, int], options: argparse.Namespace
) -> dict[Any, list[Spent]]:
    """Measure resets to some plans in random order."""
    order = [key for key in plans for _ in range(options.repeats)]
    random.Random(options.seed).shuffle(order)
    times: dict[Any, list[Spent]] = defaultdict(list)
    for key in order:
        times[key].append(clock.measure(partial(environment.reset, plans[key]))[1])
        environment.step("RotateRight")
    return times


class Clock:
    """Measures the times of calls, in parts of this process and in the simulator."""

    def __init__(self, simulator: Simulator, own: Spent) -> None:
        controller: Any = simulator._controller
        self._path = Path(f"/proc/{controller.server.unity_proc.pid}/schedstat")
        self._own = own

    def measure(self, run: Callable[[], Any]) -> tuple[Any, Spent]:
        """Return the result of a call, and its times."""
        before = self._now()
        result = run()
        spent = {name: value - before.get(name, 0.0) for name, value in self._now().items()}
        spent["processor"] = spent["here"] + spent["simulator"]
        spent["rest"] = spent.pop("here") - sum(spent.get(name, 0.0) for name in _PLACES)
        return result, spent

    def _now(self) -> Spent:
        there = int(self._path.read_text().split()[0]) / 1e6
        return {
            **self._own,
            "simulator": there,
            "here": 1e3 * time.process_time(),
            "clock": 1e3 * time.perf_counter(),
        }


@contextmanager
def measure_places() -> Iterator[Spent]:
    """Measure the processor milliseconds of the parts of this process within the context."""
    spent: Spent = dict.fromkeys(_PLACES, 0.0)
    with ExitStack() as stack:
        for name, functions in _PLACES.items():
            for owner, function in functions:
                stack.enter_context(
                    mock.patch.object(
                        owner, function, _timing(getattr(owner, function), spent, name)
                    )
                )
        yield spent


def _timing(run: Callable[..., Any], spent: Spent, name: str) -> Callable[..., Any]:
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return run(*args, **kwargs)
        finally:
            spent[name] += 1e3 * (time.process_time() - start)

    return wrapper


def nearest(plans: Sequence[Plan], kind: PlanKind, number: int) -> list[int]:
    """Return the indices of the plans of a kind, those nearest to a number first."""
    return sorted(
        (plan.index for plan in plans if plan.kind == kind), key=lambda index: abs(index - number)
    )


def median(times: Sequence[Spent], name: str) -> float:
    """Return the median time of one part."""
    return statistics.median(spent.get(name, 0.0) for spent in times)


def show(title: str, times: dict[Any, list[Spent]], numbers: Sequence[int]) -> None:
    """Print a table of kinds by numbers of plans."""
    print(
        f"{title:45}" + "".join(f"{f'i = {number}':>18}" for number in numbers) + "   last by first"
    )
    for kind in _KINDS:
        values = [
            (median(times[kind, i], "processor"), median(times[kind, i], "clock")) for i in numbers
        ]
        cells = "".join(f"{processor:9.1f} ({clock:6.1f})" for processor, clock in values)
        print(f"  {kind:43}{cells}   {values[-1][0] / values[0][0]:.2f}")


def show_places(again: dict[Any, list[Spent]], actions: list[Spent]) -> None:
    """Print the median times of the parts."""
    print(f"{'parts':45}" + "".join(f"{name:>11}" for name in _COLUMNS))
    rows = {f"reset to {kind}": [spent for key,
                                 times in again.items() if key[0] == kind for spent in times]
            for kind in _KINDS}  # fmt: skip
    for name, times in {**rows, "an action": actions}.items():
        print(f"  {name:43}" + "".join(f"{median(times, place):11.1f}" for place in _COLUMNS))


if __name__ == "__main__":
    main()
