"""Whether a plan far into a long trajectory costs more to prepare than an early one.

    python benchmarks/plan_preparation.py [--trajectory FILE] [--plans 1 25 50 100] [--repeats 10]

A trajectory of 700 steps is made in kitchen-1 (a minute or two) unless one is given. Twice, as models act in it (with
frames) and as baselines do (nothing drawn):
  in order   the environment is reset to each plan and the expert acts in it, as an episode goes. The first reset to a
             plan carries the expert's actions out as well: of the plans of a kind that are nearest to number i, the
             median of what the reset took by the number of those actions;
  at random  when the environment has come by everywhere: the median of resets to the plan of a kind that is nearest to
             number i, from wherever the last one was.

Milliseconds are of the processor, this process's and the simulator's together, on the clock in brackets. The last
tables tell where they go.
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

Spent = dict[str, float]  # milliseconds, by place
_KINDS = (PlanKind.GOTO, PlanKind.PICKUP, PlanKind.PUT)
_PLACES: dict[str, list[tuple[Any, str]]] = {
    "transport": [(SafeController, "step")],
    "decoding": [(simulators, "view_of")],
    "ways": [(Grid, "distances_to")],
    "goals": [(rewards, "goal_holds"), (expert, "goal_holds")],
    "writing": [(FrameFolder, "keep")],
}
_COLUMNS = ("simulator", *_PLACES, "rest", "processor")


def main() -> None:
    """Measure with frames and without, and print."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        trajectory = next(iter_trajectories(options.trajectory or made(Path(scratch))))
        print(f"{trajectory.traj_id}: {len(trajectory.plan.low_actions)} steps; milliseconds")
        for seen in (True, False):
            print(f"\n{'with frames' if seen else 'nothing drawn'}")
            prepare(trajectory, seen, options)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trajectory", type=Path, help="of many plans, in a procedural scene")
    parser.add_argument("--plans", type=int, nargs="+", default=[1, 25, 50, 100], help="numbers of plans, from 0")
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the order at random")
    return parser.parse_args()


def made(out: Path) -> Path:
    """A folder with a long trajectory."""
    with Simulator(embedded_launch()) as simulator:
        result = generate_set([TrajectorySettings("kitchen-1", 1, 700, 20, max_fail=700)], simulator, out)
    if result.failures:
        raise SystemExit(result.failures[0])
    return out


def prepare(trajectory: Trajectory, seen: bool, options: argparse.Namespace) -> None:
    """Measure one way of acting and print its tables."""
    with (
        Simulator(embedded_launch(), image=seen, instances=False, max_copies=512) as simulator,
        tempfile.TemporaryDirectory() as folder,
        watched() as own,
    ):
        environment = PlanEnvironment(trajectory, simulator, frames=FrameFolder(Path(folder)) if seen else NoFrames())
        if max(options.plans) >= len(environment.plans):
            raise SystemExit(f"there are {len(environment.plans)} plans; give a longer trajectory, or --plans")
        clock = Clock(simulator, own)
        resets, actions = episode(environment, clock)
        counts = [plan.low[1] - plan.low[0] for plan in environment.plans]
        by_action = [{name: ms / n for name, ms in spent.items()} for spent, n in zip(resets, counts, strict=True)]
        places = {(kind, i): nearest(environment.plans, kind, i) for kind in _KINDS for i in options.plans}
        in_order = {key: [by_action[at] for at in found[: options.repeats]] for key, found in places.items()}
        again = at_random(environment, clock, {key: found[0] for key, found in places.items()}, options)
    show("in order, for each of the expert's actions", in_order, options.plans)
    show("at random", again, options.plans)
    show_places(again, actions)


def episode(environment: PlanEnvironment, clock: "Clock") -> tuple[list[Spent], list[Spent]]:
    """The expert in all plans; what each reset took, and each action that an agent carries out."""
    resets, actions = [], []
    for plan in environment.plans:
        resets.append(clock.of(partial(environment.reset, plan.index))[1])
        over = False
        for action in environment.expert_actions(plan.index):
            if not over:
                outcome, spent = clock.of(partial(environment.step, action.call))
                actions.append(spent)
                over = outcome.terminated
    return resets, actions


def at_random(
    environment: PlanEnvironment, clock: "Clock", plans: dict[Any, int], options: argparse.Namespace
) -> dict[Any, list[Spent]]:
    """What resets to some plans take, in whatever order."""
    order = [key for key in plans for _ in range(options.repeats)]
    random.Random(options.seed).shuffle(order)
    taken: dict[Any, list[Spent]] = defaultdict(list)
    for key in order:
        taken[key].append(clock.of(partial(environment.reset, plans[key]))[1])
        environment.step("RotateRight")
    return taken


class Clock:
    """Tells what calls take, in this process, by place, and in the simulator's."""

    def __init__(self, simulator: Simulator, own: Spent) -> None:
        controller: Any = simulator._controller
        self._path = Path(f"/proc/{controller.server.unity_proc.pid}/schedstat")
        self._own = own

    def of(self, run: Callable[[], Any]) -> tuple[Any, Spent]:
        """What a call gives, and what it takes."""
        before = self._now()
        result = run()
        spent = {name: value - before.get(name, 0.0) for name, value in self._now().items()}
        spent["processor"] = spent["here"] + spent["simulator"]
        spent["rest"] = spent.pop("here") - sum(spent.get(name, 0.0) for name in _PLACES)
        return result, spent

    def _now(self) -> Spent:
        there = int(self._path.read_text().split()[0]) / 1e6
        return {**self._own, "simulator": there, "here": 1e3 * time.process_time(), "clock": 1e3 * time.perf_counter()}


@contextmanager
def watched() -> Iterator[Spent]:
    """The processor's milliseconds that this process spends in some places meanwhile."""
    spent: Spent = dict.fromkeys(_PLACES, 0.0)
    with ExitStack() as stack:
        for name, functions in _PLACES.items():
            for owner, function in functions:
                stack.enter_context(mock.patch.object(owner, function, _timing(getattr(owner, function), spent, name)))
        yield spent


def _timing(run: Callable[..., Any], spent: Spent, name: str) -> Callable[..., Any]:
    def timed(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return run(*args, **kwargs)
        finally:
            spent[name] += 1e3 * (time.process_time() - start)

    return timed


def nearest(plans: Sequence[Plan], kind: PlanKind, number: int) -> list[int]:
    """The plans of a kind, those nearest to a number first."""
    return sorted((plan.index for plan in plans if plan.kind == kind), key=lambda index: abs(index - number))


def median(taken: Sequence[Spent], name: str) -> float:
    """The median of what one place took."""
    return statistics.median(spent.get(name, 0.0) for spent in taken)


def show(title: str, taken: dict[Any, list[Spent]], numbers: Sequence[int]) -> None:
    """Print a table of kinds by numbers of plans."""
    print(f"{title:45}" + "".join(f"{f'i = {number}':>18}" for number in numbers) + "   last by first")
    for kind in _KINDS:
        values = [(median(taken[kind, i], "processor"), median(taken[kind, i], "clock")) for i in numbers]
        cells = "".join(f"{processor:9.1f} ({clock:6.1f})" for processor, clock in values)
        print(f"  {kind:43}{cells}   {values[-1][0] / values[0][0]:.2f}")


def show_places(again: dict[Any, list[Spent]], actions: list[Spent]) -> None:
    """Print where it goes, medians."""
    print(f"{'where it goes':45}" + "".join(f"{name:>11}" for name in _COLUMNS))
    rows = {f"reset to {kind}": [spent for key, found in again.items() if key[0] == kind for spent in found]
            for kind in _KINDS}  # fmt: skip
    for name, taken in {**rows, "an action": actions}.items():
        print(f"  {name:43}" + "".join(f"{median(taken, place):11.1f}" for place in _COLUMNS))


if __name__ == "__main__":
    main()
