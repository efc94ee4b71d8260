"""What an agent is paid for a plan, action by action (docs/plan-rewards.md).

An action is paid by the plan's kind. One that is refused ends the plan and gives nothing; one that the kind has no use
for gives nothing and ends nothing. On top of that comes, once, the reward of the whole task, when its goal comes to
hold with an action that neither fails nor is of no use.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import unknown_name
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.household.containment import contents_of, is_in
from infthor_eval.household.goals import APPLIANCE, goal_holds
from infthor_eval.household.navigation import Grid, GridPose
from infthor_eval.household.scout import grid_pose_of
from infthor_eval.household.tasks import Task
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind, UnfitPlanError
from infthor_eval.plans.targets import PlanTarget, in_hand, subject_of
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject

__all__ = ["PlanReward", "RewardRules", "StepReward", "max_reward", "n_on_the_way", "reward_rules"]

_FILE = Path(__file__).with_name("rewards.yaml")
_SMALL_ANGLE = 0.01  # of a look; below it the camera is where it should be
_TREATMENTS = {PlanKind.CLEAN, PlanKind.HEAT, PlanKind.COOL}
_COOLINGS = 3  # cooled, opened again, picked up again
_NOTHING = Treatments()


class RewardRules(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A set of rules, as `rewards.yaml` has it.

    Attributes:
        task_done: once, when the goal of the plan's task comes to hold.
        per_step: of GotoLocation, per step of the shortest way gained.
        nearer_than: of GotoLocation, the steps left below which it is done.
        look_degrees: by which one LookUp or LookDown turns.
        rewards: per success, by kind.
        valid_actions: those that a kind has a use for, in AI2-THOR's names.
        steps_count_once: whether what was gained, lost and gained again on the way is paid once. The published rule
            pays it each time, so that walking to and fro earns.
        treatments_unnoticed: published fault: nothing ever counts as washed, heated or cooled.
        puts_fail: published fault: every PutObject counts as refused.
    """

    task_done: float
    per_step: float
    nearer_than: int
    look_degrees: float
    rewards: dict[PlanKind, float]
    valid_actions: dict[PlanKind, frozenset[str]]
    steps_count_once: bool
    treatments_unnoticed: bool
    puts_fail: bool

    def document(self) -> dict[str, Any]:
        """All of it as JSON values, for fingerprints."""
        document: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self, order="sorted"))
        return document


@dataclass(frozen=True)
class StepReward:
    """What one action gave.

    Attributes:
        reward: for the plan and for the task.
        done: whether the plan ended with it, carried out.
        failed: whether the plan ended with it, not carried out.
    """

    reward: float = 0.0
    done: bool = False
    failed: bool = False


def reward_rules(name: str) -> RewardRules:
    """The rules of a name: "default", or "published-compat", which has the published faults.

    Raises:
        UsageError: there are none of this name.
    """
    known = read_yaml(_FILE, "install the package anew")
    if name not in known:
        raise unknown_name("reward rules", name, known)
    return msgspec.convert(known[name], RewardRules)


class PlanReward:
    """The rewards of one plan, from its start on.

    Attributes:
        treatments: what was washed, heated and cooled up to now; nothing where the rules take no notice of it.
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
            rules: what is paid.
            target: what the plan asks for.
            task: the task that the plan is part of.
            start: the world at the plan's start.
            treatments: what was washed, heated and cooled in this task before.
            grid: the cells that can be reached; GotoLocation needs it.

        Raises:
            UnfitPlanError: the plan lacks what its kind needs, or the scene does.
            ValueError: GotoLocation without a grid.
        """
        _check(target, start)
        self._rules, self._target, self._task, self._start = rules, target, task, start
        self.treatments = Treatments() if rules.treatments_unnoticed else treatments
        self._in_plan = Treatments()  # a thing washed before is to be washed again where a plan says so
        self._subject = subject_of(target, start)
        self._way = _way(rules, target, grid)
        self._closest = math.inf if self._way is None else self._way.left(start.agent)
        self._stages: set[str] = set()
        self._task_open = not goal_holds(task, start, self.treatments)
        self._goal_reached = self._over = False

    @property
    def goal_reached(self) -> bool:
        """Whether the task's goal came to hold in this plan."""
        return self._goal_reached

    def after(self, call: Mapping[str, Any], before: SimulatorView, after: SimulatorView) -> StepReward:
        """What an action gave.

        Args:
            call: the action, as `Simulator.step(**call)` takes it.
            before: the world before it.
            after: the world after it.

        Raises:
            ValueError: the plan is over.
        """
        if self._over:
            raise ValueError("the plan is over; begin the next one")
        action, object_id = call["action"], call.get("objectId")
        rules, kind = self._rules, self._target.kind
        self._follow(action, object_id, after)
        if not after.success or (rules.puts_fail and action == "PutObject"):
            step = StepReward(failed=True)
        elif action not in rules.valid_actions[kind]:
            step = StepReward()
        else:
            step = _KINDS[kind](self, action, object_id, before, after)
            step = step if step.failed else self._with_task(step, after)
        self._over = step.done or step.failed
        return step

    def _follow(self, action: str, object_id: str | None, after: SimulatorView) -> None:
        if not self._rules.treatments_unnoticed:
            self.treatments = self.treatments.after(action, object_id, after)
            self._in_plan = self._in_plan.after(action, object_id, after)

    def _with_task(self, step: StepReward, after: SimulatorView) -> StepReward:
        """The same, and the task's reward where its goal holds for the first time."""
        if not self._task_open or not goal_holds(self._task, after, self.treatments):
            return step
        self._task_open, self._goal_reached = False, True
        return StepReward(step.reward + self._rules.task_done, step.done, step.failed)

    # -- the kinds

    def _goto(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        assert self._way is not None  # as of every GotoLocation
        left = self._way.left(after.agent)
        reference = self._closest if self._rules.steps_count_once else self._way.left(before.agent)
        self._closest = min(self._closest, left)
        gained = max(0.0, reference - left) if math.isfinite(reference) else 0.0
        arrived = left < self._rules.nearer_than
        return StepReward(gained * self._rules.per_step + arrived * self._worth, done=arrived)

    def _pickup(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        if action != "PickupObject":
            return StepReward()
        return self._success() if in_hand(self._wanted, after) else StepReward(failed=True)

    def _put(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        receptacle = self._target.receptacle_id or ""
        there = is_in(self._wanted, receptacle, after)
        if action == "PutObject" and not there:
            return StepReward(failed=True)
        around = _is_closed(self._start.objects[receptacle])
        if action == "PutObject":
            return self._stage("put", last=not around)
        if not around or object_id != receptacle:
            return StepReward()
        if action == "OpenObject":
            return self._stage("open")
        return self._stage("close", last=True) if there and "put" in self._stages else StepReward()

    def _open(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        return self._success() if object_id == self._wanted and after.objects[object_id].is_open else StepReward()

    def _close(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        return self._success() if object_id == self._wanted and not after.objects[object_id].is_open else StepReward()

    def _toggle(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        if object_id != self._wanted:
            return StepReward()
        changed = after.objects[object_id].is_toggled != self._start.objects[object_id].is_toggled
        return self._success() if changed else StepReward()

    def _slice(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        return self._success() if action == "SliceObject" and object_id == self._wanted else StepReward()

    def _clean(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        return self._success() if self._subject in self._in_plan.clean else StepReward()

    def _heat(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        return self._success() if self._subject in self._in_plan.hot else StepReward()

    def _cool(self, action: str, object_id: str | None, before: SimulatorView, after: SimulatorView) -> StepReward:
        subject = self._subject or ""
        if subject not in self._in_plan.cold:
            return StepReward()
        if "cooled" not in self._stages:
            return self._stage("cooled")
        fridge = before.objects.get(object_id or "")
        if action == "OpenObject" and fridge is not None and fridge.object_type == "Fridge":
            holds = subject in contents_of(fridge.object_id, before.objects)
            return self._stage("reopened") if holds else StepReward()
        picked = action == "PickupObject" and subject in after.inventory and "reopened" in self._stages
        return self._stage("picked up", last=True) if picked else StepReward()

    # -- their parts

    @property
    def _worth(self) -> float:
        return self._rules.rewards[self._target.kind]

    @property
    def _wanted(self) -> str:
        return self._target.object_id or ""

    def _success(self) -> StepReward:
        return StepReward(self._worth, done=True)

    def _stage(self, name: str, last: bool = False) -> StepReward:
        """One of several successes, each paid once."""
        new = name not in self._stages
        self._stages.add(name)
        return StepReward(self._worth * new, done=last)


def max_reward(
    rules: RewardRules,
    target: PlanTarget,
    start: SimulatorView,
    grid: Grid | None = None,
    completes: Task | None = None,
) -> float:
    """The most that a plan can give from its start.

    Where steps do not count once, there is no most: walking to and fro earns without end. Then too it is that of the
    shortest way.

    Args:
        rules: what is paid.
        target: what the plan asks for.
        start: the world at the plan's start.
        grid: the cells that can be reached; GotoLocation needs it.
        completes: the task, where the plan can make its goal hold; None where it cannot, or the goal holds already.
    """
    kind, worth = target.kind, rules.rewards[target.kind]
    puts, treats = kind == PlanKind.PUT, kind in _TREATMENTS
    most = worth
    if kind == PlanKind.GOTO:
        most = _most_on_the_way(rules, target, start, grid)
    elif treats:
        times = _COOLINGS if kind == PlanKind.COOL else 1
        most = 0.0 if rules.treatments_unnoticed or rules.puts_fail else worth * times
    elif puts:
        closed = _is_closed(start.objects[target.receptacle_id or ""])
        most = worth * (closed + (0 if rules.puts_fail else 1 + closed))
    if completes is None or (rules.puts_fail and puts):
        return most
    unnoticed = rules.treatments_unnoticed and completes.task_type in APPLIANCE
    return most if unnoticed else most + rules.task_done


def n_on_the_way(rules: RewardRules, target: PlanTarget, poses: Sequence[AgentPose], grid: Grid | None = None) -> int:
    """How many of some actions GotoLocation takes: it is done some steps before the end of a way. Other plans take all.

    Args:
        rules: what is paid.
        target: what the plan asks for.
        poses: after each of the actions.
        grid: the cells that can be reached; GotoLocation needs it.
    """
    way = _way(rules, target, grid)
    lefts = [math.inf if way is None else way.left(pose) for pose in poses]
    return next((number for number, left in enumerate(lefts, 1) if left < rules.nearer_than), len(poses))


def _most_on_the_way(rules: RewardRules, target: PlanTarget, start: SimulatorView, grid: Grid | None) -> float:
    """Every step of the shortest way up to where it is done, and arriving; at least one step has to be made."""
    way = _way(rules, target, grid)
    left = math.inf if way is None else way.left(start.agent)
    if math.isinf(left):
        return 0.0
    gained = max(left - (rules.nearer_than - 1), min(left, 1))
    return gained * rules.per_step + rules.rewards[PlanKind.GOTO]


class _Way:
    """The shortest ways to a pose."""

    def __init__(self, goal: GridPose, horizon: float, grid: Grid, look_degrees: float) -> None:
        self._grid, self._horizon, self._look = grid, horizon, look_degrees
        self._distances = grid.distances_to(goal)

    def left(self, pose: AgentPose) -> float:
        """Number of actions left; a look begun counts whole. Infinite where there is no way."""
        steps = self._distances.get(grid_pose_of(pose, self._grid), math.inf)
        looks = abs(self._horizon - pose.horizon) / self._look
        return steps + math.ceil(looks - _SMALL_ANGLE)


def _way(rules: RewardRules, target: PlanTarget, grid: Grid | None) -> _Way | None:
    """The ways to where a plan leads; None where it leads nowhere."""
    if target.goal_stand is None:
        return None
    if grid is None:
        raise ValueError("a GotoLocation plan needs the grid")
    return _Way(target.goal_stand, target.goal_horizon, grid, rules.look_degrees)


def _is_closed(item: ThorObject) -> bool:
    return item.openable and not item.is_open


def _check(target: PlanTarget, start: SimulatorView) -> None:
    """Refuse a plan that nobody can carry out for want of what it is about."""
    kind = target.kind
    if kind == PlanKind.GOTO:
        if target.goal_stand is None:
            raise UnfitPlanError(f"this {kind} plan has no pose to reach; leave it out")
        return
    subject = subject_of(target, start)
    if subject not in start.objects:
        named = "has no object" if subject is None else f"is about {subject}, which the scene has not"
        raise UnfitPlanError(f"this {kind} plan {named}; leave it out")
    if kind == PlanKind.PUT and target.receptacle_id not in start.objects:
        raise UnfitPlanError(
            f"the {kind} plan's receptacle is {target.receptacle_id}, which the scene has not; leave it out"
        )


_KINDS: dict[PlanKind, Callable[[PlanReward, str, str | None, SimulatorView, SimulatorView], StepReward]] = {
    PlanKind.GOTO: PlanReward._goto,
    PlanKind.PICKUP: PlanReward._pickup,
    PlanKind.PUT: PlanReward._put,
    PlanKind.OPEN: PlanReward._open,
    PlanKind.CLOSE: PlanReward._close,
    PlanKind.TOGGLE: PlanReward._toggle,
    PlanKind.SLICE: PlanReward._slice,
    PlanKind.CLEAN: PlanReward._clean,
    PlanKind.HEAT: PlanReward._heat,
    PlanKind.COOL: PlanReward._cool,
}
