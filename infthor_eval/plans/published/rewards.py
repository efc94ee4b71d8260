"""Rewards of plans exactly as the published functions give them (`env/tasks.py`, `env/reward.py`).

What they do otherwise than one would expect is kept, and listed in docs/plan-rewards.md. Where they
raise an exception, which ends the published script, `UnscoredError` is raised here.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import HighAction, PlannerAction, TaskInfo
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.published.goals import Scene, Treated, goal_holds
from infthor_eval.plans.published.paths import Pose, PublishedPaths
from infthor_eval.plans.reward_rules import RewardRules
from infthor_eval.thor.view import SimulatorView, ThorObject

_CELL = 0.25  # metres
_QUARTER = 90
_UNTREATED = Treated()  # as in the published script, which never notices a treatment


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

        Raises:
            UnscoredError: the published function raises an exception.
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
        return goal_holds(self.info, Scene(state.objects, state.held, treated))

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
