"""One trajectory as an environment like Gymnasium's: reset to any of its plans, then step until it is over."""

from collections import Counter
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.navigation import Grid
from infthor_eval.household.scout import HORIZON_STEP, grid_pose_of, reachable_grid
from infthor_eval.plans.expert import Expert, ExpertAction
from infthor_eval.plans.memory import Past
from infthor_eval.plans.plan import Plan, PlanKind, plans_of, tasks_of
from infthor_eval.plans.rewards import (
    PlanReward,
    RewardRules,
    StepReward,
    count_actions_to_goal,
    max_reward,
    reward_rules,
)
from infthor_eval.plans.targets import PlanTarget, target_of
from infthor_eval.thor.actions import UngroundedError, ground, parse_action, text_of_call
from infthor_eval.thor.frames import FrameKeeper, NoFrames
from infthor_eval.thor.recorded import degrees_of
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView

__all__ = ["Ended", "Observation", "PlanEnvironment", "StepInfo", "StepOutcome"]

MAX_STEPS = 50


class Ended(StrEnum):
    """How a plan ended."""

    DONE = "done"
    REFUSED = "refused by the simulator"
    NO_ACTION = "no action"
    UNKNOWN_OBJECT = "unknown object"
    NOT_IN_VIEW = "not in view"
    NOT_POSSIBLE = "not possible"
    WRONG = "wrong outcome"
    LIMIT = "step limit"


@dataclass(frozen=True)
class Observation:
    """What an agent observes.

    Attributes:
        view: the simulator's view.
        frame: its picture as a reference; None if the environment keeps no frames.
    """

    view: SimulatorView
    frame: FrameRef | None


@dataclass(frozen=True)
class StepInfo:
    """Details of a step.

    Attributes:
        call: call of the simulator; None if the text could not be turned into one.
        action: the action in words, as it is added to the history; empty if there is no call.
        message: what was wrong with it; empty if nothing was.
        ended: how the plan ended with it; None if it goes on.
        goal_reached: whether the goal of the whole task has been reached in this plan.
    """

    call: Mapping[str, Any] | None
    action: str
    message: str = ""
    ended: Ended | None = None
    goal_reached: bool = False


class StepOutcome(NamedTuple):
    """The result of `step`, in Gymnasium's order."""

    observation: Observation
    reward: float
    terminated: bool
    truncated: bool
    info: StepInfo


class PlanEnvironment:
    """One trajectory.

    Once the expert has passed a plan, a reset to it restores a copy in the embedded simulator, wherever it is in the
    trajectory. Unity repeats all actions before it.

    Attributes:
        plans: plans that can be reset to.
        tasks: tasks that they belong to.
        look_degrees: angle by which a look up or down turns the camera.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        simulator: Simulator,
        *,
        rules: RewardRules | None = None,
        max_steps: int = MAX_STEPS,
        frames: FrameKeeper | None = None,
        in_words: bool = False,
    ) -> None:
        """Restore the scene.

        Args:
            trajectory: trajectory whose expert defines the true states.
            simulator: simulator; it should keep a copy of its state for each plan (`max_copies`).
            rules: reward rules; None for the default ones.
            max_steps: number of steps after which a plan is truncated.
            frames: keeps the frames; None keeps none.
            in_words: whether the past is also described in words; the simulator must then send instance masks.

        Raises:
            DataError: the trajectory has a task without a goal, or an unknown kind of plan.
            SimulatorError: the simulator has no such scene or fails.
        """
        self.plans: Sequence[Plan] = plans_of(trajectory)
        self.tasks = tasks_of(trajectory)
        self._simulator = simulator
        self._rules = rules or reward_rules("default")
        self._max_steps = max_steps
        self._frames = frames or NoFrames()
        self.look_degrees = _look_degrees(trajectory)
        self._expert = Expert(trajectory, self.plans, self.tasks, simulator, self._frames, in_words)
        self._plan: Plan | None = None
        self._n_steps = 0

    def reset(self, plan: int = 0) -> tuple[Observation, Mapping[str, Any]]:
        """Bring the world to the true state before a plan.

        Returns:
            The observation, and information: `max_reward`, the highest possible reward from here, and `n_expert`, the
            number of the expert's actions.

        Raises:
            IndexError: there is no such plan.
            ExpertRefusedError: this simulator refuses an action of the expert before the plan's end.
            InfeasibleError: the scene lacks an object of the plan.
            SimulatorError: the simulator fails.
        """
        if not 0 <= plan < len(self.plans):
            raise IndexError(f"there is no plan {plan}; there are 0 to {len(self.plans) - 1}")
        present = self.plans[plan]
        # The whole plan is replayed before its start is restored: a plan whose expert fails here is infeasible, and the
        # expert's end is the goal of GotoLocation.
        expert_actions = self._expert.actions(plan)
        start, end = self._expert.start(plan), self._expert.start(plan + 1)
        view = self._simulator.rewind(start.mark, exactly=True)
        task = self.tasks[present.task].task
        grid = self._grid(present, expert_actions, view)
        target = self._target(present, view, end.mark.view.agent, grid)
        self._reward = PlanReward(self._rules, target, task, view, start.treatments, grid)
        self._preferred = _preferred_objects(target, view)
        self._plan, self._n_steps = present, 0
        n_actions = count_actions_to_goal(self._rules, target, [action.pose for action in expert_actions], grid)
        completes = any(action.completes for action in expert_actions[:n_actions])
        most = max_reward(self._rules, target, view, grid, task if completes else None)
        return Observation(view, start.frame), {"max_reward": most, "n_expert": len(expert_actions)}

    def step(self, action: str | Mapping[str, Any]) -> StepOutcome:
        """Execute one action of the present plan.

        Args:
            action: text of the action (`PickupObject Mug`), or a call of AI2-THOR's.

        Raises:
            RuntimeError: the plan is over, or there was no reset.
            SimulatorError: the simulator fails.
        """
        if self._plan is None:
            raise RuntimeError("no plan is under way; reset the environment to one")
        before = self._simulator.view
        try:
            text, call = self._ground(action, before)
        except UngroundedError as error:
            self._plan = None
            info = StepInfo(None, "", str(error), Ended(str(error.misuse)))
            return StepOutcome(Observation(before, None), 0.0, True, False, info)
        return self._execute(text, call, before)

    def past(self, plan: int) -> Past:
        """Return the history before a plan, only if frames are kept; raises ExpertRefusedError as `reset` does."""
        return self._expert.past(plan)

    def expert_actions(self, plan: int) -> Sequence[ExpertAction]:
        """Return the expert's actions of a plan; raises ExpertRefusedError as `reset` does."""
        return self._expert.actions(plan)

    def named_objects(self, plan: int) -> Sequence[str]:
        """Return the ids of the objects that a plan names and that the scene has; for pictures, not for rewards.

        Raises:
            ExpertRefusedError: as `reset`.
        """
        present, view = self.plans[plan], self._expert.start(plan).mark.view
        grounding = deepcopy(self._expert.grounding)  # it remembers its choices, and a picture must not decide any
        ids = (grounding.ground(key, view) for key in (present.object_id, present.receptacle_id) if key is not None)
        return [key for key in ids if key is not None]

    def _ground(self, action: str | Mapping[str, Any], view: SimulatorView) -> tuple[str, Mapping[str, Any]]:
        if not isinstance(action, str):
            return str(text_of_call(action, view)), action
        text = parse_action(action)
        return str(text), ground(text, view, self.look_degrees, self._preferred)

    def _execute(self, text: str, call: Mapping[str, Any], before: SimulatorView) -> StepOutcome:
        after = self._simulator.step(**call)
        self._n_steps += 1
        earned = self._reward.after(call, before, after)
        ended = _ending(earned, after)
        truncated = ended is None and self._n_steps >= self._max_steps
        if ended is not None or truncated:
            self._plan = None
        info = StepInfo(call, text, after.error, Ended.LIMIT if truncated else ended, self._reward.goal_reached)
        observation = Observation(after, self._frames.keep(after))
        return StepOutcome(observation, earned.reward, ended is not None, truncated, info)

    def _target(self, plan: Plan, view: SimulatorView, end: AgentPose, grid: Grid | None) -> PlanTarget:
        """Return the target of a plan; that of GotoLocation is the pose in which the expert ended."""
        if grid is not None:
            return PlanTarget(plan.kind, goal_stand=grid_pose_of(end, grid), goal_horizon=end.horizon)
        return target_of(plan, self._expert.grounding, view)

    def _grid(self, plan: Plan, expert_actions: Sequence[ExpertAction], view: SimulatorView) -> Grid | None:
        """Return the reachable cells for GotoLocation, None for other plans.

        The expert's own cells are added: the simulator need not report all of them, yet the expert stood there.
        """
        if plan.kind != PlanKind.GOTO:
            return None
        walked = [view.agent, *(action.pose for action in expert_actions)]
        return reachable_grid(self._simulator).with_positions((pose.position.x, pose.position.z) for pose in walked)


def _ending(earned: StepReward, after: SimulatorView) -> Ended | None:
    if earned.done:
        return Ended.DONE
    if not earned.failed:
        return None
    return Ended.WRONG if after.success else Ended.REFUSED


def _preferred_objects(target: PlanTarget, start: SimulatorView) -> set[str]:
    """Return the ids that ambiguous words mean: the plan's objects, and what they are in (one of ten drawers)."""
    named = [start.objects[key] for key in (target.object_id, target.receptacle_id) if key in start.objects]
    return {key for item in named for key in (item.object_id, *(item.parent_receptacles or ()))}


def _look_degrees(trajectory: Trajectory) -> float:
    """Return the angle of most looks up or down in this trajectory: 15 degrees in ALFRED's, 30 in others."""
    looks = Counter(
        degrees_of(low) for low in trajectory.plan.low_actions if low.api_action.action in {"LookUp", "LookDown"}
    )
    return looks.most_common(1)[0][0] if looks else float(HORIZON_STEP)
