"""The expert's own actions carry every plan of a bundled trajectory out, and earn the most that
there is."""

import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.navigation import GRID, GridPose
from infthor_eval.household.scout import reachable_grid
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind, plans_of, tasks_of
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import PlanReward, max_reward
from infthor_eval.plans.targets import PlanTarget, target_of
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import translate
from infthor_eval.thor.restore import restore

from ...helpers.bundled import BUNDLED


def recorded_goal(plan, grid):
    """Where the recording says that a plan leads."""
    x, z, turn, horizon = map(int, plan.location.removeprefix("loc|").split("|"))
    stand = GridPose(grid.cell(x * GRID, z * GRID), turn * 90)
    return PlanTarget(plan.kind, goal_stand=stand, goal_horizon=float(horizon))


# The kitchen has all kinds but switching a lamp on; the bedroom has that, stacks, and two of a
# thing.
@pytest.mark.parametrize("name", ["kitchen-1-seed5", "bedroom-2-seed7"])
def test_every_plan_is_carried_out(simulator, name):
    trajectory = next(iter_trajectories(BUNDLED / "metadata" / name / "traj_data.json"))
    rules = reward_rules("default")
    restored = restore(simulator, trajectory.scene)
    assert not restored.refused and not restored.dropped
    grounding, treatments = Grounding(simulator.view), Treatments()
    tasks, plans = tasks_of(trajectory), plans_of(trajectory, Words.PUBLISHED)
    for plan in plans:
        begins = plan.index == 0 or plans[plan.index - 1].task != plan.task
        treatments = Treatments() if begins else treatments
        task, start = tasks[plan.task].task, simulator.view
        grid = reachable_grid(simulator) if plan.kind == PlanKind.GOTO else None
        target = target_of(plan, grounding, start) if grid is None else recorded_goal(plan, grid)
        held = goal_holds(task, start, treatments)
        reward, earned, ended = PlanReward(rules, target, task, start, treatments, grid), 0.0, None
        for low in trajectory.plan.low_actions[slice(*plan.low)]:
            before = simulator.view
            call = translate(low, grounding, before)
            after = simulator.step(**call)
            treatments = treatments.after(call["action"], call.get("objectId"), after)
            if ended is None:
                step = reward.after(call, before, after)
                earned += step.reward
                ended = step if step.done or step.failed else None
        assert ended is not None and ended.done, f"plan {plan.index}: {plan.text}"
        holds = goal_holds(task, simulator.view, treatments)
        completes = task if holds and not held else None
        assert earned == pytest.approx(max_reward(rules, target, start, grid, completes)), plan.text
        last = plan.index + 1 == tasks[plan.task].end_high
        assert holds if last else completes is None
