"""One trajectory as an environment in Gymnasium's manner: reset to any of its plans, then step until it is over."""

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
from infthor_eval.plans.rewards import PlanReward, RewardRules, StepReward, max_reward, n_on_the_way, reward_rules
from infthor_eval.plans.targets import PlanTarget, target_of
from infthor_eval.thor.actions import ActionText, UngroundedError, ground, parse_action, text_of_call
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
    """What there is to be seen.

    Attributes:
        view: the simulator's.
        frame: the same picture as a reference; None where the environment keeps no frames.
    """

    view: SimulatorView
    frame: FrameRef | None


@dataclass(frozen=True)
class StepInfo:
    """What came of an action.

    Attributes:
        call: what the simulator was asked; None where the text could not be turned into a call.
        action: the action in words, as it goes into the history; empty likewise.
        message: what was wrong with it; empty where nothing was.
        ended: how the plan ended with it; None where it goes on.
        goal_reached: whether the whole task's goal came to hold with it.
    """

    call: Mapping[str, Any] | None
    action: str
    message: str = ""
    ended: Ended | None = None
    goal_reached: bool = False


class StepOutcome(NamedTuple):
    """What `step` gives, in Gymnasium's order."""

    observation: Observation
    reward: float
    terminated: bool
    truncated: bool
    info: StepInfo


class PlanEnvironment:
    """One trajectory.

    Preparing a plan costs the embedded simulator the same wherever it is, once the expert has come by; Unity repeats
    the actions before it.

    Attributes:
        plans: what can be reset to.
        tasks: the tasks that they belong to.
        look_degrees: by how much a look up or down turns the camera.
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
            trajectory: whose expert is the truth.
            simulator: where it happens; several copies of its state are kept (`max_copies`).
            rules: of rewards; the default ones where None.
            max_steps: of one plan, after which it is truncated.
            frames: keeps what is seen; nothing is kept where None.
            in_words: whether the past is to be told in words too; the simulator must tell what each pixel shows then.

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
            What is seen, and information: `max_reward`, the most that the rules allow from here, and `n_expert`, the
            number of actions that the expert took.

        Raises:
            IndexError: there is no such plan.
            ExpertRefusedError: this simulator refuses an action of the expert before the plan's end.
            UnfitPlanError: the scene has not what the plan is about.
            SimulatorError: the simulator fails.
        """
        if not 0 <= plan < len(self.plans):
            raise IndexError(f"there is no plan {plan}; there are 0 to {len(self.plans) - 1}")
        found = self.plans[plan]
        expert_actions = self._expert.actions(plan)
        start, end = self._expert.start(plan), self._expert.start(plan + 1)
        view = self._simulator.rewind(start.mark, exactly=True)
        task = self.tasks[found.task].task
        grid = self._grid(found, expert_actions, view)
        target = self._target(found, view, end.mark.view.agent, grid)
        self._reward = PlanReward(self._rules, target, task, view, start.treatments, grid)
        self._meant = _meant(target, view)
        self._plan, self._n_steps = found, 0
        n_acts = n_on_the_way(self._rules, target, [action.pose for action in expert_actions], grid)
        completes = any(action.completes for action in expert_actions[:n_acts])
        most = max_reward(self._rules, target, view, grid, task if completes else None)
        return Observation(view, start.frame), {"max_reward": most, "n_expert": len(expert_actions)}

    def step(self, action: str | Mapping[str, Any]) -> StepOutcome:
        """Carry out one action of the present plan.

        Args:
            action: its text (`PickupObject Mug`), or a call of AI2-THOR's.

        Raises:
            RuntimeError: the plan is over, or was never begun.
            SimulatorError: the simulator fails.
        """
        if self._plan is None:
            raise RuntimeError("no plan is under way; reset the environment to one")
        before = self._simulator.view
        try:
            text, call = self._grounded(action, before)
        except UngroundedError as error:
            self._plan = None
            info = StepInfo(None, "", str(error), Ended(str(error.misuse)))
            return StepOutcome(Observation(before, None), 0.0, True, False, info)
        return self._carried_out(text, call, before)

    def past(self, plan: int) -> Past:
        """What there is to remember before a plan; only where frames are kept.

        Raises:
            ExpertRefusedError: as `reset`.
        """
        return self._expert.past(plan)

    def expert_actions(self, plan: int) -> Sequence[ExpertAction]:
        """What the expert did for a plan.

        Raises:
            ExpertRefusedError: as `reset`.
        """
        return self._expert.actions(plan)

    def named(self, plan: int) -> Sequence[str]:
        """Ids of the objects that a plan names, as far as they are there; for looking at, not for rewards.

        Raises:
            ExpertRefusedError: as `reset`.
        """
        found, view = self.plans[plan], self._expert.start(plan).mark.view
        grounding = deepcopy(self._expert.grounding)  # what is chosen here must not decide what an action is about
        ids = (grounding.ground(key, view) for key in (found.object_id, found.receptacle_id) if key is not None)
        return [key for key in ids if key is not None]

    def _grounded(self, action: str | Mapping[str, Any], view: SimulatorView) -> tuple[str, Mapping[str, Any]]:
        if not isinstance(action, str):
            return str(text_of_call(action, view)), action
        text: ActionText = parse_action(action)
        return str(text), ground(text, view, self.look_degrees, self._meant)

    def _carried_out(self, text: str, call: Mapping[str, Any], before: SimulatorView) -> StepOutcome:
        after = self._simulator.step(**call)
        self._n_steps += 1
        earned = self._reward.after(call, before, after)
        ended = self._ended(earned, after)
        truncated = ended is None and self._n_steps >= self._max_steps
        if ended is not None or truncated:
            self._plan = None
        info = StepInfo(call, text, after.error, Ended.LIMIT if truncated else ended, self._reward.goal_reached)
        seen = Observation(after, self._frames.keep(after))
        return StepOutcome(seen, earned.reward, ended is not None, truncated, info)

    @staticmethod
    def _ended(earned: StepReward, after: SimulatorView) -> Ended | None:
        if earned.done:
            return Ended.DONE
        if not earned.failed:
            return None
        return Ended.WRONG if after.success else Ended.REFUSED

    def _target(self, plan: Plan, view: SimulatorView, end: AgentPose, grid: Grid | None) -> PlanTarget:
        """What the plan asks for; to go somewhere is to stand and look as the expert did in the end."""
        if grid is not None:
            return PlanTarget(plan.kind, goal_stand=grid_pose_of(end, grid), goal_horizon=end.horizon)
        return target_of(plan, self._expert.grounding, view)

    def _grid(self, plan: Plan, expert_actions: Sequence[ExpertAction], view: SimulatorView) -> Grid | None:
        """Where the agent can stand; where the expert went in this plan it can, whatever the simulator says."""
        if plan.kind != PlanKind.GOTO:
            return None
        walked = [view.agent, *(action.pose for action in expert_actions)]
        return reachable_grid(self._simulator).with_positions((pose.position.x, pose.position.z) for pose in walked)


def _meant(target: PlanTarget, start: SimulatorView) -> set[str]:
    """What a plan means where words do not tell: its objects, and what they are in (a thing in one of ten drawers)."""
    named = [start.objects[key] for key in (target.object_id, target.receptacle_id) if key in start.objects]
    return {key for item in named for key in (item.object_id, *(item.parent_receptacles or ()))}


def _look_degrees(trajectory: Trajectory) -> float:
    """By how much a look up or down turns the camera in this trajectory: 15 degrees in ALFRED's, 30 in others."""
    looks = Counter(
        degrees_of(low) for low in trajectory.plan.low_actions if low.api_action.action in {"LookUp", "LookDown"}
    )
    return looks.most_common(1)[0][0] if looks else float(HORIZON_STEP)
