"""One trajectory as an environment like Gymnasium's: reset to any plan, step until it is over."""

from collections import Counter
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.goals import GoalConditions, goal_conditions
from infthor_eval.household.navigation import Grid
from infthor_eval.household.scout import HORIZON_STEP, find_viewpoint, grid_pose_of, reachable_grid
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.expert import Expert, ExpertAction
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.plan import Plan, PlanKind, plans_of, tasks_of
from infthor_eval.plans.published.script import PublishedReward, PublishedScript, current_call
from infthor_eval.plans.reward_rules import RewardRules, reward_rules
from infthor_eval.plans.rewards import PlanReward, StepReward, count_actions_to_goal, max_reward
from infthor_eval.plans.targets import PlanTarget, target_of
from infthor_eval.thor.actions import UngroundedError, ground, parse_action, text_of_call
from infthor_eval.thor.frames import FrameKeeper, NoFrames
from infthor_eval.thor.recorded import degrees_of
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView

MAX_STEPS = 50


class Ended(StrEnum):
    """How a plan ended."""

    DONE = "done"
    REFUSED = "refused by the simulator"
    NO_ACTION = "no action"
    UNKNOWN_OBJECT = "unknown object"
    NOT_IN_VIEW = "not in view"
    NOT_POSSIBLE = "not possible"
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
        conditions: conditions of the task's goal that are met where the plan ended; None while it
            goes on.
    """

    call: Mapping[str, Any] | None
    action: str
    message: str = ""
    ended: Ended | None = None
    goal_reached: bool = False
    conditions: GoalConditions | None = None


class StepOutcome(NamedTuple):
    """The result of `step`, in Gymnasium's order."""

    observation: Observation
    reward: float
    terminated: bool
    truncated: bool
    info: StepInfo


class PlanEnvironment:
    """One trajectory.

    Once the expert has passed a plan, a reset to it restores a copy in the embedded simulator,
    wherever it is in the trajectory. Unity repeats all actions before it.

    Attributes:
        trajectory: the trajectory.
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
        words: Words = Words.PUBLISHED,
        max_steps: int = MAX_STEPS,
        frames: FrameKeeper | None = None,
        in_words: bool = False,
        in_one_go: bool = False,
    ) -> None:
        """Restore the scene.

        Args:
            trajectory: trajectory whose expert defines the true states.
            simulator: simulator; it should keep a copy of its state for each plan (`max_copies`).
            rules: reward rules; None for the default ones.
            words: the words of plans and actions.
            max_steps: number of steps after which a plan is truncated.
            frames: keeps the frames; None keeps none.
            in_words: whether the past is also described in words; the simulator must then send
                instance masks.
            in_one_go: whether published rewards are those of a final task that is done in one go.

        Raises:
            DataError: the trajectory has a task without a goal, or an unknown kind of plan.
            SimulatorError: the simulator has no such scene or fails.
        """
        self.trajectory = trajectory
        self.plans: Sequence[Plan] = plans_of(trajectory, words)
        self.tasks = tasks_of(trajectory)
        self._simulator = simulator
        self._rules = rules or reward_rules("default")
        self._words = words
        self._max_steps = max_steps
        self._frames = frames or NoFrames()
        self.look_degrees = _look_degrees(trajectory)
        self._expert = Expert(
            trajectory, self.plans, self.tasks, simulator, self._frames, words, in_words
        )
        self._script: PublishedScript | None = None
        if self._rules.scoring == "published":
            self._script = PublishedScript(
                self._rules, trajectory, self.plans, self.tasks, simulator, in_one_go=in_one_go
            )
            self._expert.watched_by(self._script.pass_plan)
        self._plan: Plan | None = None
        self._reward: PlanReward | PublishedReward
        self._preferred: set[str] = set()
        self._treatments = Treatments()  # since the start of the present task
        self._n_steps = 0

    def reset(self, plan: int = 0) -> tuple[Observation, Mapping[str, Any]]:
        """Bring the world to the true state before a plan.

        Returns:
            The observation, and information: `max_reward`, the highest possible reward from here
            (under the published rules the planner's, as there is no highest), `n_expert`, the
            number of the expert's actions, and `expert_reward`, what the published loop adds to the
            expert's total (None under other rules).

        Raises:
            IndexError: there is no such plan.
            ExpertRefusedError: this simulator refuses an action of the expert before the plan's
                end.
            InfeasibleError: the scene lacks an object of the plan, or the published rewards fail in
                it.
            SimulatorError: the simulator fails.
        """
        if not 0 <= plan < len(self.plans):
            raise IndexError(f"there is no plan {plan}; there are 0 to {len(self.plans) - 1}")
        present = self.plans[plan]
        # The whole plan is replayed before its start is restored: a plan whose expert fails here is
        # infeasible, and the expert's end is the goal of GotoLocation.
        expert_actions = self._expert.actions(plan)
        start = self._expert.start(plan)
        end = self._expert.start(plan + 1)
        view = self._simulator.rewind(start.mark, exactly=True)
        self._plan = present
        self._n_steps = 0
        self._treatments = start.treatments
        info: dict[str, Any] = {"n_expert": len(expert_actions), "expert_reward": None}
        if self._script is not None:
            scripted = self._script.plan(plan)
            self._reward = PublishedReward(scripted.task.copy(), scripted.sub_goal)
            info |= {"max_reward": scripted.planner_reward, "expert_reward": scripted.expert_reward}
        else:
            goal = end.mark.view.agent
            info["max_reward"] = self._begin_default(present, view, start.treatments, goal)
        return Observation(view, start.frame), info

    def go_on(self, plan: int) -> tuple[Observation, Mapping[str, Any]]:
        """Begin a later plan of the same task without a reset; returns what `reset` does.

        The expert must have passed it (`expert_actions`) before the reset, as it would otherwise
        act in this world.

        Raises:
            InfeasibleError: the scene lacks an object of the plan, or the published rewards fail in
                it.
            SimulatorError: the simulator fails.
        """
        present = self.plans[plan]
        view = self._simulator.view
        self._plan = present
        self._n_steps = 0
        info: dict[str, Any] = {"n_expert": len(self._expert.actions(plan)), "expert_reward": None}
        if self._script is not None:
            scripted = self._script.plan(plan)
            assert isinstance(self._reward, PublishedReward)
            self._reward = self._reward.next_plan(scripted.sub_goal)
            info |= {"max_reward": scripted.planner_reward, "expert_reward": scripted.expert_reward}
        else:
            assert isinstance(self._reward, PlanReward)
            end = self._expert.start(plan + 1).mark.view.agent
            info["max_reward"] = self._begin_default(present, view, self._reward.treatments, end)
        return Observation(view, self._frames.keep(view)), info

    def _begin_default(
        self, plan: Plan, view: SimulatorView, treatments: Treatments, end: AgentPose
    ) -> float:
        """Begin a plan under the default rules, and return its highest possible reward."""
        task = self.tasks[plan.task].task
        actions = self._expert.actions(plan.index)
        grid = self._grid(plan, actions, view)
        target = self._target(plan, view, end, grid)
        self._preferred = _preferred_objects(target, view)
        self._reward = PlanReward(self._rules, target, task, view, treatments, grid)
        poses = [action.pose for action in actions]
        n_actions = count_actions_to_goal(self._rules, target, poses, grid)
        completes = any(action.completes for action in actions[:n_actions])
        return max_reward(self._rules, target, view, grid, task if completes else None)

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
            ended = Ended(str(error.misuse))
            info = StepInfo(None, "", str(error), ended, conditions=self._conditions(before))
            self._plan = None
            return StepOutcome(Observation(before, None), 0.0, True, False, info)
        return self._execute(text, call, before)

    def past(self, plan: int) -> Past:
        """Return the history before a plan, if frames are kept; raises as `reset` does."""
        return self._expert.past(plan)

    def expert_actions(self, plan: int) -> Sequence[ExpertAction]:
        """Return the expert's actions of a plan; raises ExpertRefusedError as `reset` does."""
        return self._expert.actions(plan)

    def named_objects(self, plan: int) -> Sequence[str]:
        """Return the ids of a plan's objects in the scene; for pictures, not for rewards.

        Raises:
            ExpertRefusedError: as `reset`.
        """
        present = self.plans[plan]
        view = self._expert.start(plan).mark.view
        # A grounding remembers its choices, and a picture must not decide any.
        grounding = deepcopy(self._expert.grounding)
        recorded = filter(None, (present.object_id, present.receptacle_id))
        ids = [grounding.ground(key, view) for key in recorded]
        return [key for key in ids if key is not None]

    def actions_to(self, object_id: str) -> list[str]:
        """Return the shortest way to where an object is visible; none if there is no such way.

        For subjects that know the room, not for what a subject sees.

        Raises:
            SimulatorError: the simulator fails.
        """
        grid = reachable_grid(self._simulator)
        viewpoint = find_viewpoint(self._simulator, grid, [object_id])
        agent = self._simulator.view.agent
        path = None
        if viewpoint is not None:
            path = grid.path(grid_pose_of(agent, grid), viewpoint.pose)
        if viewpoint is None or path is None:
            return []
        looks = round((viewpoint.horizon - agent.horizon) / self.look_degrees)
        return [*path, *["LookDown" if looks > 0 else "LookUp"] * abs(looks)]

    def _ground(
        self, action: str | Mapping[str, Any], view: SimulatorView
    ) -> tuple[str, Mapping[str, Any]]:
        force = {"forceAction": True} if self._rules.force_action else {}
        if not isinstance(action, str):
            return str(text_of_call(action, view, self._words)), {**action, **force}
        if self._rules.grounding == "published":
            return action, {**current_call(action, view), **force}
        text = parse_action(action)
        call = ground(text, view, self.look_degrees, self._preferred, self._words)
        return str(text), {**call, **force}

    def _conditions(self, view: SimulatorView) -> GoalConditions:
        assert self._plan is not None
        return goal_conditions(self.tasks[self._plan.task].task, view, self._treatments)

    def _execute(self, text: str, call: Mapping[str, Any], before: SimulatorView) -> StepOutcome:
        after = self._simulator.step(**call)
        self._n_steps += 1
        earned = self._reward.after(call, before, after)
        ended = _ending(earned)
        truncated = ended is None and self._n_steps >= self._max_steps
        self._treatments = self._treatments.after(call["action"], call.get("objectId"), after)
        conditions = None
        if ended is not None or truncated:
            conditions = self._conditions(after)
            self._plan = None
        ending = Ended.LIMIT if truncated else ended
        info = StepInfo(call, text, after.error, ending, self._reward.goal_reached, conditions)
        observation = Observation(after, self._frames.keep(after))
        return StepOutcome(observation, earned.reward, ended is not None, truncated, info)

    def _target(
        self, plan: Plan, view: SimulatorView, end: AgentPose, grid: Grid | None
    ) -> PlanTarget:
        """Return a plan's target; that of GotoLocation is the pose in which the expert ended."""
        if grid is not None:
            stand = grid_pose_of(end, grid)
            return PlanTarget(plan.kind, goal_stand=stand, goal_horizon=end.horizon)
        return target_of(plan, self._expert.grounding, view)

    def _grid(
        self, plan: Plan, expert_actions: Sequence[ExpertAction], view: SimulatorView
    ) -> Grid | None:
        """Return the reachable cells for GotoLocation, None for other plans.

        The expert's own cells are added: the simulator need not report all of them, yet the expert
        stood there.
        """
        if plan.kind != PlanKind.GOTO:
            return None
        walked = [view.agent, *(action.pose for action in expert_actions)]
        return reachable_grid(self._simulator).with_positions(
            (pose.position.x, pose.position.z) for pose in walked
        )


def _ending(earned: StepReward) -> Ended | None:
    if earned.done:
        return Ended.DONE
    return Ended.REFUSED if earned.failed else None


def _preferred_objects(target: PlanTarget, start: SimulatorView) -> set[str]:
    """Return the ids that ambiguous words mean: the plan's objects, and what they are in."""
    preferred = set()
    for key in (target.object_id, target.receptacle_id):
        if key in start.objects:
            preferred |= {key, *(start.objects[key].parent_receptacles or ())}
    return preferred


def _look_degrees(trajectory: Trajectory) -> float:
    """Return the angle of most looks up or down: 15 degrees in ALFRED's trajectories, else 30."""
    looks = Counter(
        degrees_of(low)
        for low in trajectory.plan.low_actions
        if low.api_action.action in {"LookUp", "LookDown"}
    )
    return looks.most_common(1)[0][0] if looks else float(HORIZON_STEP)
