"""The published loop (`run_interactive_eval.py`): which state each plan is rewarded from, and which
call an agent's text is.

The loop sets up a task at its first plan, and again after each plan, before the expert repeats that
plan. So the agent meets a task that has counted the expert's actions of the plan before, from the
first sub-goal on. In the first plan of each task the state before the agent's first action is the
scene's first one. A sub-goal without actions ends the loop. The scripts of final tasks go on with
the next task, and look at the last one before the final one alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from msgspec import UNSET, UnsetType

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.scout import reachable_grid
from infthor_eval.plans.expert import Replayed
from infthor_eval.plans.plan import Plan, TrajectoryTask
from infthor_eval.plans.published.paths import PublishedGraph, PublishedPaths
from infthor_eval.plans.published.rewards import PublishedState, PublishedTask, UnscoredError
from infthor_eval.plans.reward_rules import RewardRules
from infthor_eval.plans.rewards import StepReward
from infthor_eval.thor.actions import Misuse, UngroundedError
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

_CELL = 0.25  # metres
_FIRST = "TeleportFull"  # the last action of a scene that was set up
_Has = Callable[[ThorObject], bool | UnsetType]

_HAS: Mapping[str, _Has] = {
    "OpenObject": lambda obj: obj.openable,
    "CloseObject": lambda obj: obj.is_open,
    "PickupObject": lambda obj: obj.pickupable,
    "SliceObject": lambda obj: obj.sliceable,
}
_WITHOUT_OBJECT = {
    *("MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight"),
    *("LookUp", "LookDown", "Crouch", "Stand", "Pass", "NoOp", "Done"),
}
_PUT = "PutObject"
_TOGGLE = "ToggleObject"


class _UnreportedError(LookupError):
    """The metadata of an object lack a property."""


class PublishedReward:
    """The rewards of one plan as the published loop gives them; `goal_reached` see `PlanReward`."""

    def __init__(self, task: PublishedTask, sub_goal: int) -> None:
        self._task = task
        self._sub_goal = sub_goal
        self.goal_reached = False

    def after(
        self, call: Mapping[str, Any], before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        """Return the reward of an agent's action; see `PlanReward.after`.

        A put into a receptacle counts as refused, though it was carried out: the script binds its
        event to a name of another spelling, and takes the error that follows for a failure.
        Switching on or off is refused, as the script sends `ToggleObject`, which AI2-THOR does not
        have.

        Raises:
            UnscoredError: the published functions raise an exception.
        """
        action = call["action"]
        fails = (action == "PutObject" and "objectId" in call) or action.startswith("ToggleObject")
        if fails or not after.success:
            return StepReward(failed=True)
        earned = self._task.transition(PublishedState.of(after, action), target=self._sub_goal)
        self.goal_reached = self._task.goal_reached
        return StepReward(earned.reward, done=earned.plan_done)

    def next_plan(self, sub_goal: int) -> "PublishedReward":
        """Return the rewards of a later plan of the same task, which goes on from here."""
        return PublishedReward(self._task, sub_goal)


@dataclass(frozen=True)
class ScriptedPlan:
    """A plan as the loop comes to it.

    Attributes:
        task: the task as the agent meets it.
        sub_goal: index of the plan among the task's sub-goals.
        expert_reward: what the loop adds to the expert's total with this plan.
        planner_reward: what an agent earns that repeats the expert.
    """

    task: PublishedTask
    sub_goal: int
    expert_reward: float
    planner_reward: float


class PublishedScript:
    """The tasks of one trajectory, plan by plan."""

    def __init__(
        self,
        rules: RewardRules,
        trajectory: Trajectory,
        plans: Sequence[Plan],
        tasks: Sequence[TrajectoryTask],
        simulator: Simulator,
        *,
        in_one_go: bool = False,
    ) -> None:
        """Take a trajectory whose scene was restored in a simulator.

        `in_one_go` is True for the scripts in which an agent has the final task alone, in one go.

        Raises:
            InfeasibleError: the agent can reach no cell.
            SimulatorError: the simulator fails.
        """
        self._rules = rules
        self._trajectory = trajectory
        self._plans = plans
        self._tasks = tasks
        self._empty = _first_empty(plans, tasks[-2:-1] if in_one_go else tasks)
        self._first = PublishedState.of(simulator.view, _FIRST)
        grid = reachable_grid(simulator)
        cells = {(round(x / _CELL), round(z / _CELL)) for x, z in map(grid.position, grid.cells)}
        if not cells:
            raise InfeasibleError(
                "the agent can reach no cell, so that there are no published distances"
            )
        self._graph = PublishedGraph(cells)
        self._passed: dict[int, ScriptedPlan | UnscoredError] = {}
        # With the expert's actions of the plan passed last.
        self._repeated: PublishedTask | None = None
        self._stopped: UnscoredError | None = None

    def plan(self, index: int) -> ScriptedPlan:
        """Return a plan that the expert has passed.

        Raises:
            UnscoredError: the published functions raise an exception before its end, or the plan
                belongs to no task.
        """
        passed = self._passed.get(index)
        if passed is None:
            raise UnscoredError(
                f"plan {index} belongs to no task, and the published loop never comes to it"
            )
        if isinstance(passed, UnscoredError):
            raise passed
        return passed

    def pass_plan(self, plan: Plan, replayed: Sequence[Replayed]) -> None:
        """Take the expert's actions of the next plan."""
        if not plan.in_task:
            return
        try:
            if self._stopped is not None:
                raise self._stopped
            if self._empty is not None and plan.high > self._empty:
                raise UnscoredError(
                    f"the published script ends at sub-goal {self._empty}, which has no actions"
                )
            self._passed[plan.index] = self._pass(plan, replayed)
        except UnscoredError as error:
            self._passed[plan.index] = error
            self._stopped = error

    def _pass(self, plan: Plan, replayed: Sequence[Replayed]) -> ScriptedPlan:
        sub_goal = plan.high - self._tasks[plan.task].first_high
        met = self._repeated if sub_goal else None
        if met is None:
            met = self._new_task(plan.task)
        states = [PublishedState.of(view, action.call["action"]) for action, view, *_ in replayed]
        self._repeated = self._new_task(plan.task)
        expert_reward = sum(self._repeated.transition(state).reward for state in states)
        planner_reward = self._planner_reward(met, sub_goal, replayed)
        return ScriptedPlan(met, sub_goal, expert_reward, planner_reward)

    def _new_task(self, number: int) -> PublishedTask:
        task = self._tasks[number]
        sub_goals = self._trajectory.plan.high_pddl[task.first_high : task.end_high]
        paths = PublishedPaths(self._graph)
        return PublishedTask(self._rules, task.info, sub_goals, len(sub_goals), paths, self._first)

    def _planner_reward(
        self, met: PublishedTask, sub_goal: int, replayed: Sequence[Replayed]
    ) -> float:
        """Return what an agent earns that repeats the expert, up to a failure of the functions."""
        reward = PublishedReward(met.copy(), sub_goal)
        total = 0.0
        try:
            for action, view, *_ in replayed:
                step = reward.after(action.call, view, view)
                total += step.reward
                if step.done or step.failed:
                    break
        except UnscoredError:
            pass
        return total


def _first_empty(plans: Sequence[Plan], tasks: Sequence[TrajectoryTask]) -> int | None:
    """Return the index of the first sub-goal of a task without actions, None if all have some."""
    acted = {plan.high for plan in plans}
    every = (high for task in tasks for high in range(task.first_high, task.end_high))
    return next((high for high in every if high not in acted), None)


def ground_published(text: str, objects: Iterable[ThorObject]) -> tuple[str | None, str | None]:
    """Return the action and object id of a text with "Object" in it; None where there is none.

    As the published `interact_with_env` and `post_processing_action` do it: a name is sought as a
    part of the objects' names, case apart, and the first visible object that has the property is
    taken, whatever its state. Where the metadata of an object that is looked at lack the property,
    the script drops the action with the error.

    Args:
        text: what the agent said.
        objects: all objects, in the order of the metadata.
    """
    try:
        if text.startswith(_PUT):
            return _PUT, _first(objects, _last_word(text), lambda obj: obj.receptacle)
        if text.startswith(_TOGGLE):  # on and off alike
            return _TOGGLE, _first(objects, _last_word(text), lambda obj: obj.toggleable)
        for action, has in _HAS.items():
            if text.startswith(action):
                return action, _first(objects, text.rsplit(action, maxsplit=1)[-1].strip(), has)
    except _UnreportedError:
        pass
    return None, None


def published_call(text: str, objects: Iterable[ThorObject], held: str | None) -> dict[str, Any]:
    """Return the call that the published script sends for a text, in AI2-THOR 2.1.0's form.

    Args:
        held: id of the held object; None if there is none.

    Raises:
        LookupError: an object is to be put, and none is held; the script then sends nothing.
    """
    if "Object" not in text:
        return {"action": text, "forceAction": True}
    action, object_id = ground_published(text, objects)
    if _PUT in text and object_id is not None:
        if held is None:
            raise LookupError("nothing is held")
        ids = {"objectId": held, "receptacleObjectId": object_id}
        return {"action": _PUT, **ids, "forceAction": True, "placeStationary": True}
    ids = {} if object_id is None else {"objectId": object_id}
    return {"action": action, **ids, "forceAction": True}


def _last_word(text: str) -> str:
    return text.rsplit(maxsplit=1)[-1]


def _first(objects: Iterable[ThorObject], name: str, has: _Has) -> str | None:
    """Return the id of the first visible object with this text in its name that has a property."""
    wanted = name.lower()
    for obj in objects:
        if wanted in obj.name.lower() and obj.visible:
            value = has(obj)
            if value is UNSET:
                raise _UnreportedError(obj.object_id)
            if value:
                return obj.object_id
    return None


def current_call(text: str, view: SimulatorView) -> dict[str, Any]:
    """Return the published call for a text in the form of AI2-THOR 5.x.

    A text that is no action of an agent is not sent: the published script would send it as a
    command to the simulator, which refuses what it does not know, and would also take `Reset` from
    an agent.

    Raises:
        UngroundedError: there is nothing to send.
    """
    try:
        call = published_call(text, view.objects.values(), next(iter(view.inventory), None))
    except LookupError as error:
        raise UngroundedError(Misuse.NOT_POSSIBLE, f"{text}: {error}") from error
    if call["action"] is None or ("Object" not in text and text not in _WITHOUT_OBJECT):
        raise UngroundedError(Misuse.NO_ACTION, f"unknown action '{text}'")
    if text == "NoOp":
        call["action"] = "Pass"
    receptacle = call.pop("receptacleObjectId", None)
    return call if receptacle is None else {**call, "objectId": receptacle}
