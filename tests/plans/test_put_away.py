"""Putting away what is held, as a task of its own: read, rewarded by both rule sets, evaluated, in
the history."""

import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.history.forms import PublishedHistory
from infthor_eval.plans.plan import PlanKind, plans_of, tasks_of
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.runs import execute
from infthor_eval.thor.frames import FrameFolder

from ..helpers.prompts import join_parts
from ..helpers.trajectories import CANDLE, FORK, MUG, cut_trajectory, write_trajectories
from .outcomes import endings
from .put_away import PEN, pen_put_away, put_away_without_actions, read

PUT = 4  # the plan that puts the pen away; 22 actions, the last of which puts it


def by_expert(environment, plan):
    """What the expert's actions earn in a plan, and how it ends; `None` where they do not end
    it."""
    _, info = environment.reset(plan)
    outcomes = []
    for action in environment.expert_actions(plan):
        outcomes.append(environment.step(action.call))
        if outcomes[-1].terminated:
            break
    return [outcome.reward for outcome in outcomes], outcomes[-1].info, info["max_reward"]


def test_it_is_a_task_with_one_plan_about_the_very_objects():
    trajectory = read(pen_put_away())
    tasks, plans = tasks_of(trajectory), plans_of(trajectory, Words.PUBLISHED)
    assert [task.text for task in tasks][1] == "put the Pen on the DiningTable"
    assert tasks[1].task == Task(TaskType.PUT_AWAY, "Pen", "DiningTable")
    assert [plan.task for plan in plans] == [0] * 4 + [1] + [2] * 4
    plan = plans[PUT]
    assert (plan.kind, plan.in_task) == (PlanKind.PUT, True)
    assert plan.text == "put the Pen in the DiningTable"
    assert plan.low[1] - plan.low[0] == 22
    assert (plan.object_id, plan.receptacle_id) == (
        "Pen|-02.05|+00.75|-00.82",
        "DiningTable|-02.12|+00.00|-01.17",
    )


def test_the_default_rules_pay_the_put_and_the_task(simulator):
    environment = PlanEnvironment(read(pen_put_away()), simulator)
    rewards, last, most = by_expert(environment, PUT)
    assert rewards == [0.0] * 21 + [2 + 5]
    assert (last.ended, last.goal_reached, last.conditions, most) == ("done", True, (1, 1), 7)


def test_the_published_rules_pay_the_task_alone_and_count_the_put_as_refused(simulator):
    """By hand: no object is called "DiningTable", so that the put itself pays nothing."""
    environment = PlanEnvironment(read(pen_put_away()), simulator, rules=reward_rules("published"))
    rewards, last, _ = by_expert(environment, PUT)
    assert (sum(rewards), last.ended, last.goal_reached) == (0, "refused by the simulator", False)
    _, info = environment.reset(PUT)
    assert info["expert_reward"] == 5
    # The expert's own put of the plan before has not moved the next task's rewards.
    assert by_expert(environment, PUT + 1)[1].ended == "done"


@pytest.mark.usefixtures("shared_simulators")
def test_baselines_are_evaluated_on_it(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "away", pen_put_away(), cut_trajectory(MUG, 2))
    outcome = execute(prepare_run(data=data))
    pen_plans = [record.payload for record in outcome.records if record.cluster == PEN]
    assert [(plan.kind, plan.ended) for plan in pen_plans][PUT] == ("PutObject", "done")
    assert all(plan.ended == "done" and plan.reward == plan.max_reward for plan in pen_plans)
    assert pen_plans[PUT].goal == "put the Pen on the DiningTable"
    for name in ("random", "scripted", "history"):
        others = execute(prepare_run(name, data=data))
        of_pen = [record.payload.index for record in others.records if record.cluster == PEN]
        assert of_pen == list(range(9))
        assert not any(record.excluded for record in others.records)


@pytest.mark.usefixtures("shared_simulators")
def test_a_final_task_has_it_in_its_history(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "final", pen_put_away(final=True))
    settings = {"tasks": ("infthor_final",), "data": data}
    for rules in ({}, {"protocol": "published", "rewards": "published"}):
        outcome = execute(prepare_run(**settings, **rules))
        plans = [record.payload for record in outcome.records]
        assert [plan.index for plan in plans] == [5, 6, 7, 8]
        assert plans[0].ended == "done"


def test_the_published_history_has_its_goal_and_its_plan(simulator, tmp_path):
    environment = PlanEnvironment(read(pen_put_away()), simulator, frames=FrameFolder(tmp_path))
    environment.reset(PUT + 1)
    parts = PublishedHistory().recall(environment.past(PUT + 1), len)
    prompt = join_parts(parts)
    goal = "<|goal|>Your main goal: put the Pen on the DiningTable<|goal|><image>"
    plan = "<|plan|>Plan: put the Pen in the DiningTable<|plan|><|act|>"
    assert f"{goal}{plan}<|act|>RotateLeft<|act|>" in prompt
    put, then = (
        "<|act|>PutObject Pen DiningTable<|act|><image>",
        "<|goal|>Your main goal: look at a mug",
    )
    assert f"{put}{then}" in prompt


# -- files of before July 2026: the sub-goal without an action

ENDS = "the published script ends at sub-goal 4, which has no actions"


def test_without_actions_it_is_no_plan_and_the_others_are():
    trajectory = read(put_away_without_actions())
    types = [task.task.task_type for task in tasks_of(trajectory)]
    assert types == [TaskType.PLACE, TaskType.PUT_AWAY, TaskType.PLACE_TWO]
    plans = plans_of(trajectory, Words.PUBLISHED)
    of_first, of_last = [(high, 0) for high in range(4)], [(high, 2) for high in (5, 6)]
    assert [(plan.high, plan.task) for plan in plans] == of_first + of_last


@pytest.mark.usefixtures("shared_simulators")
def test_without_actions_the_default_goes_on_and_the_published_loop_is_over(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "old", put_away_without_actions())
    assert endings(execute(prepare_run(data=data))) == ["done"] * 6
    outcome = execute(prepare_run(data=data, rewards="published", history="published"))
    assert [record.excluded for record in outcome.records] == [None] * 4 + [ENDS] * 2


@pytest.mark.usefixtures("shared_simulators")
@pytest.mark.parametrize(("name", "n_plans", "is_last"), [(FORK, 6, True), (CANDLE, 16, False)])
def test_final_scripts_go_on_but_after_the_last_task_before_it(
    prepare_run, tmp_path, name, n_plans, is_last
):
    document = put_away_without_actions(name, n_plans, final=True)
    data = write_trajectories(tmp_path / "final", document)
    published = {"protocol": "published", "rewards": "published"}
    first, *_ = execute(prepare_run(tasks=("infthor_final",), data=data, **published)).records
    assert (first.excluded, first.payload.ended) == ((ENDS, "") if is_last else (None, "done"))
