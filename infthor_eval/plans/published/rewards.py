"""Rewards of plans exactly as the published functions give them (`env/tasks.py`, `env/reward.py`).

What they do otherwise than one would expect is kept, and listed in docs/plan-rewards.md. Where they
raise an exception, which ends the published script, `UnscoredError` is raised here.

Their goals differ from ALFRED's, which `household.goals` tests: no lamp is ever asked for, so that
looking at an object in light never counts; objects are told apart by the first part of their ids,
so that no slice is ever asked for by its type; the basin of a sink is found in tasks of two objects
alone.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import HighAction, PlannerAction, TaskInfo
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.published.paths import Pose, PublishedPaths
from infthor_eval.plans.reward_rules import RewardRules
from infthor_eval.thor.view import SimulatorView, ThorObject

_CELL = 0.25  # metres
_QUARTER = 90


@dataclass(frozen=True)
class Treated:
    """Ids of washed, heated and cooled objects. In the published script all stay empty."""

    cleaned: Collection[str] = frozenset()
    heated: Collection[str] = frozenset()
    cooled: Collection[str] = frozenset()


_UNTREATED = Treated()  # as in the published script, which never notices a treatment


@dataclass(frozen=True)
class _Scene:
    """What goals are tested on: objects by id, ids of held ones, and what was done to objects."""

    objects: Mapping[str, ThorObject]
    held: tuple[str, ...]
    treated: Treated

    def named(
        self, name: str | None, has_property: Callable[[ThorObject], bool]
    ) -> list[ThorObject]:
        """Return the objects of a name that have a property."""
        return [
            candidate
            for candidate in self.objects.values()
            if Words.PUBLISHED.name_of(candidate.object_id) == name and has_property(candidate)
        ]


class UnscoredError(InfeasibleError):
    """The published functions raise an exception here, so that there is no published reward."""


@dataclass(frozen=True)
class PublishedState:
    """The state after an action, as far as the published functions look at it."""

    last_action: str
    pose: Pose
    held: tuple[str, ...]
    objects: Mapping[str, ThorObject]

    @classmethod
    def of(cls, view: SimulatorView, last_action: str) -> "PublishedState":
        """Return the state of a simulator after an action."""
        return cls(last_action, pose_of(view), view.inventory, view.objects)


class Transition(NamedTuple):
    """What one action earns, whether the task is done with it, and whether the plan is."""

    reward: float = 0.0
    task_done: bool = False
    plan_done: bool = False


def pose_of(view: SimulatorView) -> Pose:
    """Return the pose of the agent as the published environment rounds it."""
    agent = view.agent
    x = round(agent.position.x / _CELL)
    z = round(agent.position.z / _CELL)
    return x, z, round(agent.rotation / _QUARTER) % 4, round(agent.horizon)


@dataclass
class PublishedTask:
    """One task while it is carried out; `transition` is called once for each action.

    Attributes:
        info: type of the task, and the names of its objects.
        plan: the task's sub-goals.
        n_sub_goals: number of them that complete the task.
        paths: paths that its searches found so far.
        previous: state before the next action.
        goal_index: the task's own counter of completed sub-goals.
        goal_reached: whether the task's goal has held.
        cooled: whether the reward of cooling an object was paid.
        opened_again: whether the reward of opening the fridge again was paid.
    """

    rules: RewardRules
    info: TaskInfo
    plan: Sequence[HighAction]
    n_sub_goals: int
    paths: PublishedPaths
    previous: PublishedState
    goal_index: int = 0
    goal_reached: bool = False
    cooled: bool = False
    opened_again: bool = False

    def copy(self) -> "PublishedTask":
        """Return the task as it is now, to go on with on its own."""
        other = copy(self)
        other.paths = self.paths.copy()
        return other

    def transition(
        self, state: PublishedState, treated: Treated = _UNTREATED, target: int | None = None
    ) -> Transition:
        """Return what an action earns.

        Args:
            state: state after the action.
            treated: objects that were washed, heated and cooled so far.
            target: the sub-goal whose rule applies; with 0 and None the task's own counter decides.
        """
        if self.goal_reached:
            return Transition(self.rules.task_done, True, True)
        index = target or self.goal_index
        if index >= len(self.plan):
            return Transition()
        try:
            reward, plan_done = self._plan_reward(_Step(state, self.previous, treated, index))
            self.goal_index += plan_done and self.goal_index < self.n_sub_goals
            self.goal_reached = self._goal_holds(state, treated)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            sub_goal = self.plan[index].discrete_action.action
            raise UnscoredError(
                f"the published rewards fail at {state.last_action:.40} in sub-goal {sub_goal:.40} "
                f"({error}); use --rewards default"
            ) from error
        self.previous = state
        reward += self.rules.task_done * self.goal_reached
        task_done = self.goal_index >= self.n_sub_goals or self.goal_reached
        return Transition(reward, task_done, plan_done)

    def _goal_holds(self, state: PublishedState, treated: Treated) -> bool:
        holds = _GOALS[self.info.goal.replace(" ", "_")]
        return holds(self.info, _Scene(state.objects, state.held, treated))

    def _plan_reward(self, step: "_Step") -> tuple[float, bool]:
        kind = PlanKind(self.plan[step.index].planner_action.action)
        if step.state.last_action not in self.rules.valid_actions[kind]:
            return 0.0, False
        return _RULES[kind](self, step)

    def _planner_action(self, index: int) -> PlannerAction:
        return self.plan[index].planner_action

    # -- the kinds

    def _goto(self, step: "_Step") -> tuple[float, bool]:
        goal = _location(self._planner_action(step.index))
        before = self.paths.n_actions(step.before.pose, goal)
        left = self.paths.n_actions(step.state.pose, goal)
        gained = (before - left) * self.rules.per_step if before > left else 0.0
        arrived = left < self.rules.nearer_than
        return gained + self.rules.rewards[PlanKind.GOTO] * arrived, arrived

    def _pickup(self, step: "_Step") -> tuple[float, bool]:
        if not step.state.held:
            return 0.0, False
        held = step.state.held[0]
        wanted = _required(self._planner_action(step.index).object_id, "objectId")
        return self._pay(PlanKind.PICKUP, _unsliced(held) == _unsliced(wanted))

    def _put(self, step: "_Step") -> tuple[float, bool]:
        per_success = self.rules.rewards[PlanKind.PUT]
        now = step.state.last_action
        sub_goal = self.plan[step.index]
        planner = self._planner_action(step.index)
        # What a sub-goal lacks is missed only where the published function comes to it.
        receptacle_id = ""
        if planner.object_id is None:
            sub_goal.discrete_action.args[1]  # type: ignore[index]
        else:
            receptacle_id = _required(planner.receptacle_id, "receptacleObjectId")
        if now == "OpenObject" and step.state.held:
            return per_success, False
        if planner.object_id is None:
            raise TypeError("without objectId the receptacle is a list")
        receptacle = step.state.objects.get(receptacle_id)
        if receptacle is None:
            return 0.0, False
        if receptacle.receptacle_object_ids is None:
            raise TypeError(f"{receptacle_id} has no contents")
        if planner.object_id not in receptacle.receptacle_object_ids:
            return 0.0, False
        return per_success, not (step.before.last_action == "OpenObject" and now == "PutObject")

    def _open(self, step: "_Step") -> tuple[float, bool]:
        return self._state_reward(step, PlanKind.OPEN, lambda changed: bool(changed.is_open))

    def _close(self, step: "_Step") -> tuple[float, bool]:
        return self._state_reward(step, PlanKind.CLOSE, lambda changed: not changed.is_open)

    def _toggle(self, step: "_Step") -> tuple[float, bool]:
        return self._state_reward(step, PlanKind.TOGGLE, lambda changed: changed.is_toggled)

    def _slice(self, step: "_Step") -> tuple[float, bool]:
        return self._state_reward(step, PlanKind.SLICE, lambda changed: changed.is_sliced)

    def _state_reward(
        self, step: "_Step", kind: PlanKind, is_done: Callable[[ThorObject], bool]
    ) -> tuple[float, bool]:
        """Return the reward of a state of the plan's object, by whatever action it came there."""
        object_id = _required(self._planner_action(step.index).object_id, "objectId")
        changed = step.state.objects.get(object_id)
        return self._pay(kind, changed is not None and is_done(changed))

    def _clean(self, step: "_Step") -> tuple[float, bool]:
        object_id = _required(self._planner_action(step.index).clean_id, "cleanObjectId")
        washed = step.state.objects.get(object_id)
        is_done = washed is not None and washed.object_id in step.treated.cleaned
        return self._pay(PlanKind.CLEAN, is_done)

    def _heat(self, step: "_Step") -> tuple[float, bool]:
        heated = self._put_next(step)
        is_done = heated is not None and heated.object_id in step.treated.heated
        return self._pay(PlanKind.HEAT, is_done)

    def _cool(self, step: "_Step") -> tuple[float, bool]:
        per_success = self.rules.rewards[PlanKind.COOL]
        cooled = self._put_next(step)
        if cooled is None or cooled.object_id not in step.treated.cooled:
            return 0.0, False
        if not self.cooled:
            self.cooled = True
            return per_success, False
        if step.state.last_action == "OpenObject":
            fridge_id = _required(self._planner_action(step.index).object_id, "objectId")
            fridge = step.state.objects.get(fridge_id)
            if fridge is not None and not self.opened_again and fridge.is_open:
                self.opened_again = True
                return per_success, False
        is_held = step.state.held[:1] == (cooled.object_id,)
        return self._pay(PlanKind.COOL, step.state.last_action == "PickupObject" and is_held)

    # -- their parts

    def _pay(self, kind: PlanKind, is_done: bool) -> tuple[float, bool]:
        return self.rules.rewards[kind] * is_done, is_done

    def _put_next(self, step: "_Step") -> ThorObject | None:
        """Return the object of the plan two further on, which puts it away; None at the end."""
        if step.index + 2 >= len(self.plan):
            return None
        object_id = _required(self._planner_action(step.index + 2).object_id, "objectId")
        put = step.state.objects.get(object_id)
        if put is None:
            raise TypeError(f"there is no {object_id:.80}")
        return put


@dataclass(frozen=True)
class _Step:
    state: PublishedState
    before: PublishedState
    treated: Treated
    index: int


def _required(value: str | None, name: str) -> str:
    if value is None:
        raise KeyError(name)
    return value


def _unsliced(object_id: str) -> str:
    return Words.PUBLISHED.name_of(object_id).split("Sliced")[0]


def _location(action: PlannerAction) -> Pose:
    numbers = [int(number) for number in _required(action.location, "location").split("|")[1:]]
    return numbers[0], numbers[1], numbers[2], numbers[3]


_RULES: dict[PlanKind, Callable[[PublishedTask, _Step], tuple[float, bool]]] = {
    PlanKind.GOTO: PublishedTask._goto,
    PlanKind.PICKUP: PublishedTask._pickup,
    PlanKind.PUT: PublishedTask._put,
    PlanKind.OPEN: PublishedTask._open,
    PlanKind.CLOSE: PublishedTask._close,
    PlanKind.TOGGLE: PublishedTask._toggle,
    PlanKind.SLICE: PublishedTask._slice,
    PlanKind.CLEAN: PublishedTask._clean,
    PlanKind.HEAT: PublishedTask._heat,
    PlanKind.COOL: PublishedTask._cool,
}


def _pickupable(thor_object: ThorObject) -> bool:
    return bool(thor_object.pickupable)


def _receptacle(thor_object: ThorObject) -> bool:
    return bool(thor_object.receptacle)


def _inside(target: ThorObject, receptacles: Iterable[ThorObject]) -> bool:
    return bool(_filled([target], receptacles))


def _filled(targets: Sequence[ThorObject], receptacles: Iterable[ThorObject]) -> list[ThorObject]:
    """Return the receptacles with any of the objects in them."""
    ids = {target.object_id for target in targets}
    return [each for each in receptacles if ids & set(each.receptacle_object_ids or ())]


def _targets(info: TaskInfo, scene: _Scene) -> tuple[list[ThorObject], list[ThorObject], int]:
    """Return a task's objects, its receptacles, and the number of slices that it lacks."""
    targets = scene.named(info.pickup, _pickupable)
    n_slices = sum("Sliced" in target.object_id for target in targets)
    if info.pickup is None:
        raise TypeError("the task names no object")
    lacking = max(0, 1 - n_slices) if "Sliced" in info.pickup else 0
    return targets, scene.named(info.receptacle, _receptacle), lacking


def _place(info: TaskInfo, scene: _Scene) -> bool:
    targets, receptacles, lacking = _targets(info, scene)
    return not lacking and any(_inside(target, receptacles) for target in targets)


def _place_two(info: TaskInfo, scene: _Scene) -> bool:
    targets, receptacles, _ = _targets(info, scene)
    if not receptacles and info.receptacle == "SinkBasin":
        receptacles = scene.named("Sink", _receptacle)
    if "Sliced" in str(info.pickup) and sum("Sliced" in target.object_id for target in targets) < 2:
        return False
    ids = {target.object_id for target in targets}
    contents = [set(receptacle.receptacle_object_ids or ()) for receptacle in receptacles]
    return any(len(ids & inside) >= 2 for inside in contents)


def _look_in_light(info: TaskInfo, scene: _Scene) -> bool:
    _targets(info, scene)  # which raises for a task without an object
    return False


def _place_treated(
    chosen: Callable[[Treated], Collection[str]],
) -> Callable[[TaskInfo, _Scene], bool]:
    def holds(info: TaskInfo, scene: _Scene) -> bool:
        targets, receptacles, lacking = _targets(info, scene)
        ready = [target for target in targets if target.object_id in chosen(scene.treated)]
        return not lacking and any(_inside(target, receptacles) for target in ready)

    return holds


def _place_with_movable(info: TaskInfo, scene: _Scene) -> bool:
    targets, receptacles, lacking = _targets(info, scene)
    carriers = scene.named(info.movable, _pickupable)
    filled = _filled(targets, carriers)
    there = any(_inside(carrier, receptacles) for carrier in carriers)
    ids = {receptacle.object_id for receptacle in receptacles}
    stacked = any(ids & set(carrier.parent_receptacles or ()) for carrier in filled)
    return not lacking and bool(filled) and there and stacked


def _put(info: TaskInfo, scene: _Scene) -> bool:
    """Whether anything of a name lies in anything of another, and the hand is empty.

    This is what is put away after a task.
    """
    wanted = {info.pickup, info.movable}
    receptacles = [] if scene.held else scene.named(info.receptacle, _receptacle)
    inside = (key for receptacle in receptacles for key in receptacle.receptacle_object_ids or ())
    return any(Words.PUBLISHED.name_of(key) in wanted for key in inside)


_GOALS: Mapping[str, Callable[[TaskInfo, _Scene], bool]] = {
    "pick_and_place_simple": _place,
    "pick_two_obj_and_place": _place_two,
    "look_at_obj_in_light": _look_in_light,
    "pick_clean_then_place_in_recep": _place_treated(lambda treated: treated.cleaned),
    "pick_heat_then_place_in_recep": _place_treated(lambda treated: treated.heated),
    "pick_cool_then_place_in_recep": _place_treated(lambda treated: treated.cooled),
    "pick_and_place_with_movable_recep": _place_with_movable,
    "put_object": _put,
}
