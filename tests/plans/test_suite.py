"""Runs of plans by baselines, from the request to the tables."""

import json

import pytest

from infthor_eval.episodes.records import NOT_ATTEMPTED
from infthor_eval.errors import ModelError, UsageError
from infthor_eval.exports.lm_eval import export
from infthor_eval.formats.published import PublishedRow, PublishedTable
from infthor_eval.plans.actors import baselines
from infthor_eval.runs import execute

from ..helpers.command_line import assert_refused, option_words
from ..helpers.refusals import read_one_line
from ..helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories
from .outcomes import cells, payloads, summary

pytestmark = pytest.mark.usefixtures("shared_simulators")


# -- what a run finds


def test_the_planner_carries_every_plan_out_and_earns_all_there_is(prepare_run, data):
    write_trajectories(data / "more", cut_trajectory(MUG, 2))
    outcome = execute(prepare_run())
    plans = {(record.cluster, record.payload.index): record.payload for record in outcome.records}
    # By hand, from the expert's actions: eleven steps and a look, the last of which leaves a step
    # (done with fewer than three to go); what is closed is opened and closed around a thing.
    assert {
        key: (plan.ended, len(plan.steps), plan.n_expert_steps) for key, plan in plans.items()
    } == {
        (FORK, 0): ("done", 10, 12),
        (FORK, 1): ("done", 2, 3),
        (FORK, 2): ("done", 1, 1),
        (FORK, 3): ("done", 3, 3),
        (MUG, 0): ("done", 7, 9),
        (MUG, 1): ("done", 1, 1),
    }
    assert {key: plan.reward for key, plan in plans.items()} == {
        (FORK, 0): pytest.approx(10 * 0.2 + 4),
        (FORK, 1): 2,
        (FORK, 2): pytest.approx(0.2 + 4),
        (FORK, 3): 3 * 2 + 5,
        (MUG, 0): pytest.approx(7 * 0.2 + 4),
        (MUG, 1): 2,
    }
    assert all(plan.reward == plan.max_reward for plan in plans.values())
    assert [key for key, plan in plans.items() if plan.goal_reached] == [(FORK, 3)]
    assert [step.reward for step in plans[FORK, 3].steps] == [2, 7, 2]
    goals = ["put a mug on the desk"] * 2 + ["put a fork in the drawer"] * 4
    assert [plan.goal for plan in payloads(outcome)] == goals
    assert [plan.first_step for plan in payloads(outcome)] == [0, 9, 0, 12, 15, 16]
    task = summary(outcome)
    assert (task.n_plans, task.n_trajectories, task.n_failed, task.n_actions) == (6, 2, 0, 24)
    assert task.reward.mean == task.max_reward.mean
    assert task.reward.mean == pytest.approx(((6 + 2 + 4.2 + 11) + (5.4 + 2)) / 2)
    rates = {name: (rate.mean, rate.n) for name, rate in task.success.items()}
    assert rates == {"Go to": (1, 3), "Pick up": (1, 2), "Put": (1, 1), "total": (1, 6)}
    assert (task.goals.mean, task.goals.n) == (0.5, 2)  # the mug's task is cut off
    assert task.endings == {"done": 6}
    row = cells(outcome, "Plans completed")
    assert (row["total"][:5], row["plans"], row["excluded"]) == ("100.0", "6", "0")
    assert cells(outcome, "Reward")["% of it"].startswith("100.0")
    assert outcome.run.suite.scores(outcome.records[-1]) == {"success": 1.0, "reward": 11.0}


def test_what_is_exported_has_a_sample_for_each_plan(prepare_run):
    outcome = execute(prepare_run())
    export(outcome)
    (path,) = outcome.folder.rglob("samples_infthor_plans_*.jsonl")
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert [(row["doc_id"], row["target"], row["success"]) for row in rows] == [
        (0, "go to the cabinet", 1.0),
        (1, "pick up the Fork", 1.0),
        (2, "go to the drawer", 1.0),
        (3, "put the Fork in the Drawer", 1.0),
    ]
    assert list(outcome.docs)[1].prompt == "put a fork in the drawer\npick up the Fork"


def test_the_published_rules_have_the_published_faults(prepare_run):
    plans = payloads(execute(prepare_run(rewards="published")))
    assert [(plan.ended, plan.reward) for plan in plans] == [
        ("done", pytest.approx(6)),
        ("done", 2),
        ("done", pytest.approx(4.2)),
        ("refused by the simulator", 2),  # the drawer is opened, and the put counts as refused
    ]
    assert [plan.max_reward for plan in plans] == [plan.reward for plan in plans]
    assert all(step.call["forceAction"] for plan in plans for step in plan.steps)


def test_the_limit_is_of_trajectories(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "two", cut_trajectory(FORK, 1), cut_trajectory(MUG, 1))
    outcome = execute(prepare_run("scripted", data=data, limit=1))
    assert [record.cluster for record in outcome.records] == [MUG]  # the first by name
    assert outcome.summary.header.config.limit == 1


def test_equal_seeds_act_alike_and_other_seeds_do_not(prepare_run, tmp_path):
    def actions(seed, folder):
        outcome = execute(prepare_run("random", seed=seed, output=tmp_path / folder))
        return [[step.action for step in plan.steps] for plan in payloads(outcome)]

    first = actions(7, "a")
    assert actions(7, "b") == first
    assert actions(8, "c") != first


def test_what_a_baseline_does_in_a_trajectory_depends_on_no_other(prepare_run, data, tmp_path):
    alone = payloads(execute(prepare_run("random")))
    write_trajectories(data / "more", cut_trajectory(MUG, 1))
    beside = execute(prepare_run("random", output=tmp_path / "b")).records
    assert [record.payload for record in beside if record.cluster == FORK] == alone


def test_habits_are_learnt_in_other_scenes_alone(prepare_run, data, tmp_path):
    alone = payloads(execute(prepare_run("history")))
    assert {step.action for plan in alone for step in plan.steps} == {"NoOp"}
    write_trajectories(data / "more", cut_trajectory(MUG, 4))
    learnt = payloads(execute(prepare_run("history", output=tmp_path / "b")))[4:]
    assert learnt[0].steps[0].action == "MoveAhead"
    assert learnt[1].steps[0].message.startswith("PickupObject Fork: ")  # the cabinet is closed
    assert learnt[1].ended == "not in view"


# -- final tasks


def test_final_tasks_are_those_of_trajectories_that_have_one_beside_the_published_rows(
    prepare_run, tmp_path, monkeypatch
):
    row = PublishedRow("a paper's model", (), 7.0, (10.0, 20.0, 30.0, 25.0))
    columns = ("Go to", "Pick up", "Put", "total")
    table = PublishedTable("Table 5", "here", "plans", "", "success", columns, (row,))
    monkeypatch.setattr("infthor_eval.plans.tables.published_tables", {"plans": (table,)}.get)
    data = write_trajectories(
        tmp_path / "final", cut_trajectory(FORK, 6, final=True), cut_trajectory(MUG, 2)
    )
    outcome = execute(prepare_run(tasks=("infthor_final",), data=data))
    assert [
        (record.cluster, record.payload.index, record.payload.is_final)
        for record in outcome.records
    ] == [(FORK, 4, True), (FORK, 5, True)]
    task = summary(outcome, "infthor_final")
    assert (task.n_plans, task.n_trajectories, task.success["total"].mean) == (2, 1, 1)
    (table, *_) = outcome.run.suite.tables([outcome.summary])
    assert not any(row.is_published for row in table.rows)
    assert any(
        note.startswith("Published rows stand beside runs with --protocol published")
        for note in table.notes
    )
    theirs = execute(
        prepare_run(tasks=("infthor_final",), data=data, protocol="published", rewards="published")
    )
    (table, *_) = theirs.run.suite.tables([theirs.summary])
    (published,) = [row for row in table.rows if row.is_published]
    success = ("10.0", "20.0", "30.0*", "25.0")
    assert published.cells == ("a paper's model", "published, Table 5", *success)
    plain = execute(prepare_run(data=data))
    assert len(plain.records) == 8
    assert not any(row.is_published for row in plain.run.suite.tables([plain.summary])[0].rows)


def test_where_no_trajectory_has_a_final_task_that_is_said(prepare_run, run_cli, data, tmp_path):
    said = "infthor_final: no trajectory there has a final task"
    with pytest.raises(UsageError, match=said) as caught:
        prepare_run(tasks=("infthor_final",))
    read_one_line(caught)
    words = option_words(model="planner", tasks="infthor_final", data=data, limit=3)
    assert_refused(run_cli(*words, "--out", tmp_path / "o"), said)


def test_a_model_that_draws_nothing_is_refused_before_it_is_asked_to(run_cli, data, tmp_path):
    (tmp_path / "mine.py").write_text("def answer(images, text):\n    return 'MoveAhead'\n")
    words = option_words(
        model=f"{tmp_path}/mine.py:answer", tasks="infthor_plans", data=data, out=tmp_path / "o"
    )
    assert_refused(
        run_cli(*words),
        "answer draws no replies, as infthor_plans does at temperature 1; add --greedy",
    )
    assert_refused(
        run_cli(*words, "--greedy", "--constrained"),
        "--constrained: answer cannot be held to choices; leave it out",
    )
    assert run_cli(*words, "--greedy", "--limit", 1)[0] == 0


# -- after a failure


def test_where_a_failure_ends_the_episode_later_plans_are_not_come_to_and_earn_nothing(prepare_run):
    outcome = execute(prepare_run("scripted", after_failure="stop"))
    first, *others = outcome.records
    assert first.payload.ended == "refused by the simulator"  # it walks on and on
    assert {record.payload.ended for record in others} == {NOT_ATTEMPTED}
    for plan in payloads(outcome)[1:]:
        assert (plan.steps, plan.reward, plan.max_reward) == ((), 0, None)
    task = summary(outcome)
    assert (task.n_plans, task.endings) == (4, {NOT_ATTEMPTED: 3, "refused by the simulator": 1})
    assert task.success["total"].mean == 0
    assert outcome.run.suite.scores(others[0]) == {}
    going_on = execute(prepare_run("scripted"))
    assert [plan.ended for plan in payloads(going_on)][1:] != [NOT_ATTEMPTED] * 3
    assert execute(prepare_run(after_failure="stop")).records[-1].payload.done


def test_a_failure_of_the_subject_that_is_mended_lets_a_stopped_episode_go_on(
    prepare_run, monkeypatch
):
    act = baselines._ExpertActor.act

    def fails(actor):
        if actor._situation.plan.index == 1:
            raise ModelError("out of memory")
        return act(actor)

    with monkeypatch.context() as patched:
        patched.setattr(baselines._ExpertActor, "act", fails)
        broken = execute(prepare_run(after_failure="stop"))
    # Nobody knows whether the plans after it would have been reached: they are not wrong.
    ends = [("answered", "done"), ("failed", ""), ("not asked", ""), ("not asked", "")]
    assert [(record.state, record.payload.ended) for record in broken.records] == ends
    assert broken.records[1].payload.max_reward == 2
    task = summary(broken)
    assert (task.n_failed, task.n_not_asked) == (1, 2)
    assert task.endings == {"done": 1, "failed": 1, "not asked": 2}
    total = task.success["total"]
    assert (total.mean, total.n, total.n_all, task.reward) == (1.0, 1, 4, None)
    mended = execute(prepare_run(after_failure="stop"))
    assert [record.payload.ended for record in mended.records] == ["done"] * 4
    assert [record.attempt for record in mended.records] == [1, 2, 2, 2]
