"""Measure what each departure of the default rules of plans changes: the published rules with that
one thing mended.

    python benchmarks/plan_departures.py [--only WORD] [--out FOLDER]

For each departure of docs/plan-rewards.md that can change a reward it runs planner, random,
scripted and history on the bundled set under the published rules, with the published function
replaced by one that does as the default rules do. The table has the sums of rewards, less those
under the published rules as they are.
"""

import argparse
import contextlib
import io
import math
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import msgspec
import networkx as nx

from infthor_eval.cli.main import main as command
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans import task as plans_task
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.published.paths import PublishedPaths
from infthor_eval.plans.published.rewards import (
    PublishedState,
    PublishedTask,
    Transition,
    Treated,
    pose_of,
)
from infthor_eval.plans.published.script import PublishedReward, PublishedScript
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import StepReward
from infthor_eval.plans.suite import PlansSuite
from infthor_eval.runs import read_run
from infthor_eval.thor.view import SimulatorView

_BASELINES = ("planner", "random", "scripted", "history")
_NONE = Treated()
Patch = contextlib.AbstractContextManager[Any]


def main() -> None:
    """Run all departures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="departures with this word in their name")
    parser.add_argument("--out", type=Path, help="folder of the runs")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        base = _rewards(out / "published")
        print(f"| mended | {' | '.join(_BASELINES)} |\n|---|{'---|' * len(_BASELINES)}")
        print(f"| nothing | {' | '.join(f'{base[name]:.1f}' for name in _BASELINES)} |", flush=True)
        for name, mend in _MENDINGS.items():
            if options.only in name:
                with mend():
                    rewards = _rewards(out / name.replace(" ", "-"))
                changes = (f"{rewards[baseline] - base[baseline]:+.1f}" for baseline in _BASELINES)
                print(f"| {name} | {' | '.join(changes)} |", flush=True)


def _rewards(out: Path) -> Mapping[str, float]:
    """Run the baselines in this process, where they are patched, and return the sums of their
    rewards."""
    words = [
        "run",
        "--model",
        ",".join(_BASELINES),
        "--tasks",
        "infthor_plans_mini",
        "--rewards",
        "published",
    ]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        command([*words, "--out", str(out)])
    suite, sums = PlansSuite(), {}
    for name in _BASELINES:
        (folder,) = (out / name).iterdir()
        _, records = read_run(folder, suite.records)
        sums[name] = sum(record.payload.reward for record in records if record.excluded is None)
    return sums


def _with_rules(**changes: Any) -> Patch:
    changed = lambda name: msgspec.structs.replace(reward_rules(name), **changes)  # noqa: E731
    return mock.patch.object(plans_task, "reward_rules", changed)


def _steps_pay_once() -> Patch:
    def goto(task: PublishedTask, step: Any) -> tuple[float, bool]:
        reward, arrived = original(task, step)
        paid = task.rules.rewards[PlanKind.GOTO] * arrived
        left = task.paths.n_actions(step.state.pose, _goal(task, step.index))
        closest = vars(task).setdefault("closest", {})
        before = task.paths.n_actions(step.before.pose, _goal(task, step.index))
        gained = max(0, closest.get(step.index, before) - left) if reward > paid else 0
        closest[step.index] = min(left, closest.get(step.index, before))
        return gained * task.rules.per_step + paid, arrived

    original = PublishedTask._goto
    return _rule(PlanKind.GOTO, goto)


def _rule(kind: PlanKind, rule: Callable[[PublishedTask, Any], tuple[float, bool]]) -> Patch:
    from infthor_eval.plans.published import rewards as published_rewards

    return mock.patch.dict(published_rewards._RULES, {kind: rule})


def _goal(task: PublishedTask, index: int) -> Any:
    location = task.plan[index].planner_action.location or ""
    return tuple(map(int, location.split("|")[1:]))


def _shortest_paths() -> Patch:
    def n_actions(paths: PublishedPaths, pose: Any, goal: Any) -> int:
        graph, start, end = paths._graph.graph, pose[:3], goal[:3]
        free = nx.subgraph_view(
            graph, filter_edge=lambda one, other: graph[one][other]["weight"] < 10
        )
        lengths = known.get((id(graph), end))
        if lengths is None:
            lengths = known[id(graph), end] = nx.single_source_shortest_path_length(
                free.reverse(copy=False), end
            )
        return int(lengths.get(start, 10**6)) + math.ceil(abs(pose[3] - goal[3]) / 30)

    known: dict[Any, Any] = {}
    return mock.patch.object(PublishedPaths, "n_actions", n_actions)


def _own_task_from_the_true_start() -> Patch:
    def pass_plan(script: PublishedScript, plan: Any, replayed: Any) -> None:
        start = vars(script).get("before", script._first)
        script._repeated = None
        with mock.patch.object(script, "_first", start):
            original(script, plan, replayed)
        action, view, *_ = replayed[-1]
        script.before = PublishedState.of(view, action.call["action"])  # type: ignore[attr-defined]

    original = PublishedScript.pass_plan
    return mock.patch.object(PublishedScript, "pass_plan", pass_plan)


def _goal_pays_when_it_begins_to_hold() -> Patch:
    def transition(
        task: PublishedTask,
        state: PublishedState,
        treated: Treated = _NONE,
        target: int | None = None,
    ) -> Transition:
        held = vars(task).get("held_before")
        if held is None:
            held = task.__dict__["held_before"] = task._goal_holds(task.previous, _NONE)
        task.goal_reached = False
        earned = original(task, state, treated, target)
        if held:
            earned = earned._replace(
                reward=earned.reward - task.rules.task_done * task.goal_reached
            )
        task.__dict__["held_before"] = held or task.goal_reached
        return earned

    original = PublishedTask.transition
    return mock.patch.object(PublishedTask, "transition", transition)


def _puts_count() -> Patch:
    def after(plan: PublishedReward, call: Mapping[str, Any], before: Any, view: Any) -> StepReward:
        without_id = {name: value for name, value in call.items() if name != "objectId"}
        return original(plan, without_id if call["action"] == "PutObject" else call, before, view)

    original = PublishedReward.after
    return mock.patch.object(PublishedReward, "after", after)


def _switches_count() -> Patch:
    def after(plan: PublishedReward, call: Mapping[str, Any], before: Any, view: Any) -> StepReward:
        if not call["action"].startswith("ToggleObject") or not view.success:
            return original(plan, call, before, view)
        earned = plan._task.transition(
            PublishedState.of(view, call["action"]), target=plan._sub_goal
        )
        return StepReward(earned.reward, done=earned.plan_done)

    original = PublishedReward.after
    return mock.patch.object(PublishedReward, "after", after)


def _every_plan_by_its_own_rule() -> Patch:
    def transition(
        task: PublishedTask,
        state: PublishedState,
        treated: Treated = _NONE,
        target: int | None = None,
    ) -> Transition:
        if target == 0:
            task.goal_index = 0
        return original(task, state, treated, target)

    original = PublishedTask.transition
    return mock.patch.object(PublishedTask, "transition", transition)


def _states_that_the_action_brought() -> Patch:
    def state_reward(
        task: PublishedTask, step: Any, kind: PlanKind, is_done: Any
    ) -> tuple[float, bool]:
        key = task.plan[step.index].planner_action.object_id
        now, was = step.state.objects.get(key), step.before.objects.get(key)
        if kind == PlanKind.TOGGLE:
            return task._pay(
                kind, now is not None and was is not None and now.is_toggled != was.is_toggled
            )
        if kind == PlanKind.SLICE and now is None:  # AI2-THOR 5 drops what was cut
            return task._pay(kind, was is not None)
        return task._pay(
            kind, now is not None and is_done(now) and not (was is not None and is_done(was))
        )

    return mock.patch.object(PublishedTask, "_state_reward", state_reward)


def _alfreds_treatments_and_goals() -> Patch:
    """Track washing, heating and cooling through the whole task, and test the goals as ALFRED
    does."""

    def of(view: SimulatorView, last_action: str) -> PublishedState:
        state = PublishedState(last_action, pose_of(view), view.inventory, view.objects)
        state.__dict__["view"] = view
        return state

    def new_task(script: PublishedScript, number: int) -> PublishedTask:
        task = new(script, number)
        tracked = vars(script).setdefault("tracked", {}).get(number, Treatments())
        task.__dict__.update(goal=script._tasks[number].task, treatments=tracked)
        return task

    def pass_plan(script: PublishedScript, plan: Any, replayed: Any) -> None:
        passed(script, plan, replayed)
        tracked = vars(script).setdefault("tracked", {})
        for action, view, *_ in replayed:
            now = tracked.get(plan.task, Treatments())
            tracked[plan.task] = now.after(action.call["action"], action.call.get("objectId"), view)

    def goal_holds_in(task: PublishedTask, state: PublishedState, _: Treated) -> bool:
        here = vars(task)
        here["treatments"] = _treated_with(here["treatments"], task.previous, state)
        return goal_holds(here["goal"], vars(state)["view"], here["treatments"])

    new, passed = PublishedScript._new_task, PublishedScript.pass_plan
    patches = contextlib.ExitStack()
    patches.enter_context(mock.patch.object(PublishedState, "of", of))
    patches.enter_context(mock.patch.object(PublishedScript, "_new_task", new_task))
    patches.enter_context(mock.patch.object(PublishedScript, "pass_plan", pass_plan))
    patches.enter_context(mock.patch.object(PublishedTask, "_goal_holds", goal_holds_in))
    return patches


def _treated_with(
    treatments: Treatments, before: PublishedState, now: PublishedState
) -> Treatments:
    """Return the treatments after an action: whatever was switched on or closed by it acts on what
    is in it."""
    for key, item in now.objects.items():
        was = before.objects.get(key)
        switched = was is not None and item.is_toggled and not was.is_toggled
        closed = was is not None and was.is_open and not item.is_open
        if switched or closed:
            treatments = treatments.after(
                "ToggleObjectOn" if switched else "CloseObject", key, vars(now)["view"]
            )
    return treatments


def _opening_pays_for_the_receptacle_alone() -> Patch:
    def put(task: PublishedTask, step: Any) -> tuple[float, bool]:
        reward, done = original(task, step)
        if step.state.last_action != "OpenObject" or not step.state.held:
            return reward, done
        key = task.plan[step.index].planner_action.receptacle_id or ""
        now, was = step.state.objects.get(key), step.before.objects.get(key)
        opened = now is not None and was is not None and now.is_open and not was.is_open
        return (reward, done) if opened else (0.0, False)

    original = PublishedTask._put
    return _rule(PlanKind.PUT, put)


_MENDINGS: Mapping[str, Callable[[], Patch]] = {
    "steps pay once": _steps_pay_once,
    "shortest paths": _shortest_paths,
    "a task of its own from the true start": _own_task_from_the_true_start,
    "the goal pays when it begins to hold": _goal_pays_when_it_begins_to_hold,
    "opening pays for the receptacle alone": _opening_pays_for_the_receptacle_alone,
    "puts count": _puts_count,
    "switches count": _switches_count,
    "every plan by its own rule": _every_plan_by_its_own_rule,
    "states that the action brought": _states_that_the_action_brought,
    "ALFRED's treatments and goals": _alfreds_treatments_and_goals,
    "strict grounding": partial(_with_rules, grounding="strict"),
    "no forceAction": partial(_with_rules, force_action=False),
}

if __name__ == "__main__":
    main()
