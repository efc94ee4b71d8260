"""Rewards of an agent for a plan by the default rules, action by action (docs/plan-rewards.md).

An action is rewarded by the plan's kind. A refused action ends the plan and earns nothing. An
action that is not valid for the kind earns nothing and ends nothing. The reward of the whole task
is added once, with the first valid action after which the task's goal holds.

To add or change a reward of plans: its numbers and valid actions in `rewards.yaml`; the rule of a
kind here.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.household.containment import contents_of, is_in
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.navigation import Grid, GridPose
from infthor_eval.household.scout import grid_pose_of
from infthor_eval.household.tasks import Task
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.reward_rules import RewardRules
from infthor_eval.plans.targets import TREATMENTS, PlanTarget, in_hand, subject_of
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject

# Share of a look below which the camera's angle is right: simulators report rounded angles
_SMALL_LOOK = 0.01
_COOLING_STAGES = 3  # cooled, opened again, picked up again
# The receptacle that AI2-THOR need not have opened; experts put things onto its lid.
_TAKING_WHILE_CLOSED = {"Toilet"}
_NOTHING = Treatments()


@dataclass(frozen=True)
class StepReward:
    """The reward of one action, and whether the plan was completed or failed with it."""

    reward: float = 0.0
    done: bool = False
    failed: bool = False


class PlanReward:
    """The rewards of one plan, from its start on.

    Attributes:
        treatments: what was washed, heated and cooled in the task so far.
        goal_reached: whether the task's goal has been reached in this plan.
    """

    def __init__(
        self,
        rules: RewardRules,
        target: PlanTarget,
        task: Task,
        start: SimulatorView,
        treatments: Treatments = _NOTHING,
        grid: Grid | None = None,
    ) -> None:
        """Begin a plan.

        Args:
            start: the world at the plan's start.
            treatments: what was washed, heated and cooled in this task before.
            grid: reachable cells; GotoLocation needs it.

        Raises:
            InfeasibleError: the plan lacks what its kind needs, or the scene lacks its objects.
            ValueError: GotoLocation without a grid.
        """
        _require_feasible(target, start)
        self._rules = rules
        self._target = target
        self._task = task
        self._start = start
        self.treatments = treatments
        # The plan's own treatments are apart: what was washed before is to be washed again.
        self._in_plan = Treatments()
        self._subject = subject_of(target, start)
        self._paths = _paths_to_goal(rules, target, grid)
        self._closest = math.inf if self._paths is None else self._paths.remaining(start.agent)
        self._stages: set[str] = set()
        self._task_open = not goal_holds(task, start, self.treatments)
        self.goal_reached = self._is_over = False

    def after(
        self, call: Mapping[str, Any], before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        """Return the reward of a call of `Simulator.step`; ValueError if the plan is over."""
        if self._is_over:
            raise ValueError("the plan is over; begin the next one")
        action = call["action"]
        object_id = call.get("objectId")
        rules = self._rules
        kind = self._target.kind
        # Before validity is looked at: an action that is not valid can treat an object too.
        self.treatments = self.treatments.after(action, object_id, after)
        self._in_plan = self._in_plan.after(action, object_id, after)
        if not after.success:
            step = StepReward(failed=True)
        elif action not in rules.valid_actions[kind]:
            step = StepReward()
        else:
            step = _BY_KIND[kind](self, action, object_id, before, after)
            step = step if step.failed else self._with_task(step, after)
        self._is_over = step.done or step.failed
        return step

    def _with_task(self, step: StepReward, after: SimulatorView) -> StepReward:
        """Add the task's reward if its goal holds for the first time."""
        if not self._task_open or not goal_holds(self._task, after, self.treatments):
            return step
        self._task_open = False
        self.goal_reached = True
        return StepReward(step.reward + self._rules.task_done, step.done, step.failed)

    # -- the kinds; where they depart from the published functions is said in docs/plan-rewards.md

    def _goto(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        assert self._paths is not None  # as checked when the plan began
        left = self._paths.remaining(after.agent)
        # A step that was gained, lost and gained again is rewarded once. From where there is no
        # path nothing is gained: infinity less a finite distance would be.
        gained = max(0.0, self._closest - left) if math.isfinite(self._closest) else 0.0
        self._closest = min(self._closest, left)
        arrived = left < self._rules.nearer_than
        return StepReward(gained * self._rules.per_step + arrived * self._per_success, done=arrived)

    def _pickup(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        if action != "PickupObject":
            return StepReward()
        return self._success() if in_hand(self._object_id, after) else StepReward()

    def _put_down(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        receptacle = self._target.receptacle_id or ""
        is_there = is_in(self._object_id, receptacle, after)
        if action == "PutObject" and not is_there:
            return StepReward()
        # A receptacle that was closed is to be opened and closed around the put, each with a reward
        # of its own.
        was_closed = _is_closed(self._start.objects[receptacle])
        if action == "PutObject":
            return self._complete_stage("put", last=not was_closed)
        if not was_closed or object_id != receptacle:
            return StepReward()
        if action == "OpenObject":
            return self._complete_stage("open")
        is_put = is_there and "put" in self._stages
        return self._complete_stage("close", last=True) if is_put else StepReward()

    def _open_or_close(
        self, _: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        wanted = self._target.kind == PlanKind.OPEN
        is_done = object_id == self._object_id and bool(after.objects[object_id].is_open) == wanted
        return self._success() if is_done else StepReward()

    def _toggle(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        if object_id != self._object_id:
            return StepReward()
        changed = after.objects[object_id].is_toggled != self._start.objects[object_id].is_toggled
        return self._success() if changed else StepReward()

    def _slice(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        is_done = action == "SliceObject" and object_id == self._object_id
        return self._success() if is_done else StepReward()

    def _wash_or_heat(
        self, _: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        treated = self._in_plan.clean if self._target.kind == PlanKind.CLEAN else self._in_plan.hot
        return self._success() if self._subject in treated else StepReward()

    def _cool(
        self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView
    ) -> StepReward:
        """Reward three stages in order: what is cold in the fridge is still to be taken out."""
        subject = self._subject or ""
        if subject not in self._in_plan.cold:
            return StepReward()
        if "cooled" not in self._stages:
            return self._complete_stage("cooled")
        fridge = before.objects.get(object_id or "")
        if action == "OpenObject" and fridge is not None and fridge.object_type == "Fridge":
            holds = subject in contents_of(fridge.object_id, before.objects)
            return self._complete_stage("reopened") if holds else StepReward()
        picked = action == "PickupObject" and subject in after.inventory
        is_done = picked and "reopened" in self._stages
        return self._complete_stage("picked up", last=True) if is_done else StepReward()

    # -- their parts

    @property
    def _per_success(self) -> float:
        return self._rules.rewards[self._target.kind]

    @property
    def _object_id(self) -> str:
        return self._target.object_id or ""

    def _success(self) -> StepReward:
        return StepReward(self._per_success, done=True)

    def _complete_stage(self, name: str, last: bool = False) -> StepReward:
        """Return the reward of one of several stages; it is paid once."""
        is_new = name not in self._stages
        self._stages.add(name)
        return StepReward(self._per_success * is_new, done=last)


def max_reward(
    rules: RewardRules,
    target: PlanTarget,
    start: SimulatorView,
    grid: Grid | None = None,
    completes: Task | None = None,
) -> float:
    """Return the highest possible reward of a plan from its start.

    Args:
        grid: reachable cells; GotoLocation needs it.
        completes: the task if its goal can be reached in the plan; None if it cannot, or holds
            already.
    """
    kind = target.kind
    per_success = rules.rewards[target.kind]
    most = per_success
    if kind == PlanKind.GOTO:
        most = _max_path_reward(rules, target, start, grid)
    elif kind in TREATMENTS:
        stages = _COOLING_STAGES if kind == PlanKind.COOL else 1
        most = per_success * stages
    elif kind == PlanKind.PUT:
        closed = _is_closed(start.objects[target.receptacle_id or ""])
        most = per_success * (3 if closed else 1)
    return most + rules.task_done * (completes is not None)


def count_actions_to_goal(
    rules: RewardRules, target: PlanTarget, poses: Sequence[AgentPose], grid: Grid | None = None
) -> int:
    """Return how many actions a plan takes: GotoLocation is done before its path's end.

    Args:
        target: target of the plan; plans of other kinds than GotoLocation take all actions.
        poses: poses after each of the actions.
        grid: reachable cells; GotoLocation needs it.
    """
    paths = _paths_to_goal(rules, target, grid)
    if paths is not None:
        for number, pose in enumerate(poses, 1):
            if paths.remaining(pose) < rules.nearer_than:
                return number
    return len(poses)


def _max_path_reward(
    rules: RewardRules, target: PlanTarget, start: SimulatorView, grid: Grid | None
) -> float:
    """Return the reward of the shortest path up to where the plan is done, and of arriving.

    At least one step has to be taken, even from where the plan is done already: rewards are given
    with actions.
    """
    paths = _paths_to_goal(rules, target, grid)
    left = math.inf if paths is None else paths.remaining(start.agent)
    if math.isinf(left):
        return 0.0
    gained = max(left - (rules.nearer_than - 1), min(left, 1))
    return gained * rules.per_step + rules.rewards[PlanKind.GOTO]


class _PathsToGoal:
    """The shortest paths to a pose."""

    def __init__(self, goal: GridPose, horizon: float, grid: Grid, look_degrees: float) -> None:
        self._grid = grid
        self._horizon = horizon
        self._look_degrees = look_degrees
        self._distances = grid.distances_to(goal)

    def remaining(self, pose: AgentPose) -> float:
        """Return the remaining actions, a partial look as one; infinite if there is no path."""
        steps = self._distances.get(grid_pose_of(pose, self._grid), math.inf)
        looks = abs(self._horizon - pose.horizon) / self._look_degrees
        return steps + math.ceil(looks - _SMALL_LOOK)


def _paths_to_goal(
    rules: RewardRules, target: PlanTarget, grid: Grid | None
) -> _PathsToGoal | None:
    """Return the paths to a plan's pose; None if it has none."""
    if target.goal_stand is None:
        return None
    if grid is None:
        raise ValueError("a GotoLocation plan needs the grid")
    return _PathsToGoal(target.goal_stand, target.goal_horizon, grid, rules.look_degrees)


def _is_closed(receptacle: ThorObject) -> bool:
    """Return whether a receptacle is to be opened before anything is put there."""
    if receptacle.object_type in _TAKING_WHILE_CLOSED:
        return False
    return bool(receptacle.openable and not receptacle.is_open)


def _require_feasible(target: PlanTarget, start: SimulatorView) -> None:
    """Refuse a plan whose pose or objects are missing."""
    kind = target.kind
    if kind == PlanKind.GOTO:
        if target.goal_stand is None:
            raise InfeasibleError(f"this {kind} plan has no pose to reach; leave it out")
        return
    subject = subject_of(target, start)
    if subject not in start.objects:
        problem = "has no object"
        if subject is not None:
            problem = f"is about {subject}, which the scene does not have"
        raise InfeasibleError(f"this {kind} plan {problem}; leave it out")
    if kind == PlanKind.PUT and target.receptacle_id not in start.objects:
        raise InfeasibleError(
            f"the {kind} plan's receptacle is {target.receptacle_id}, which the scene does not "
            "have; leave it out"
        )


_Rule = Callable[[PlanReward, str, str | None, SimulatorView, SimulatorView], StepReward]
_BY_KIND: dict[PlanKind, _Rule] = {
    PlanKind.GOTO: PlanReward._goto,
    PlanKind.PICKUP: PlanReward._pickup,
    PlanKind.PUT: PlanReward._put_down,
    PlanKind.OPEN: PlanReward._open_or_close,
    PlanKind.CLOSE: PlanReward._open_or_close,
    PlanKind.TOGGLE: PlanReward._toggle,
    PlanKind.SLICE: PlanReward._slice,
    PlanKind.CLEAN: PlanReward._wash_or_heat,
    PlanKind.HEAT: PlanReward._wash_or_heat,
    PlanKind.COOL: PlanReward._cool,
}
