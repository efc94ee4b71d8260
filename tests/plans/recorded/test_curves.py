"""Curves of reward, with numbers made by hand."""

import msgspec
import pytest

from infthor_eval.episodes.curves import AT_MOST, StepFunction
from infthor_eval.episodes.records import NOT_ATTEMPTED
from infthor_eval.errors import DataError, UsageError
from infthor_eval.plans.recorded.curves import Axis, plan_curves
from infthor_eval.plans.records import RECORDS
from infthor_eval.run import Run

from ...helpers.journals import spoil_config, write_journal
from ...helpers.plan_runs import TASK, make_plan_record, make_planner_run, make_plans_run

T = 12.7062  # quantile of the t interval over two trajectories
# Two trajectories: one of two plans that ends at step 20, one of a plan that ends at step 30.
PLANS = (
    make_plan_record("a", 0, (0, 10), 1.0),
    make_plan_record("a", 1, (10, 20), 2.0),
    make_plan_record("b", 0, (0, 30), 4.0),
)


def curve_of(curves, label, axis=Axis.STEPS):
    (run,) = [run for run in curves.runs if run.label == label]
    return run.curves[axis]


def replace_most(record):
    """The same plan, of which nothing more could be earned."""
    payload = msgspec.structs.replace(record.payload, max_reward=record.payload.reward)
    return msgspec.structs.replace(record, payload=payload)


def means(curve):
    return [estimate.mean for estimate in curve.means]


def test_a_step_function_has_the_last_value():
    function = StepFunction.of([(10, 1.0), (20, 2.0)], start=5)
    assert [function.at(place) for place in (0, 5, 9, 10, 19, 20, 99)] == [0, 0, 0, 1, 1, 3, 3]


def test_a_place_that_is_unknown_or_before_an_earlier_one_is_the_earlier_one():
    function = StepFunction.of([(None, 0.0), (100, 1.0), (None, 0.0), (90, 2.0), (120, 4.0)])
    assert function.places == (100, 100, 100, 100, 120)
    assert (function.at(99), function.at(100), function.at(120)) == (0, 3, 7)


def test_the_mean_over_trajectories_of_different_lengths_keeps_the_shorter_ones_end():
    curve = curve_of(plan_curves([make_plans_run("m", PLANS)]), "m")
    assert curve.places == (0, 10, 20, 30)
    assert means(curve) == [0, 0.5, 1.5, 3.5]
    reaches = [estimate.high - estimate.mean for estimate in curve.means]
    # Half the difference of the two values is the standard error; also of values between 0 and 1,
    # which are no shares.
    assert reaches == pytest.approx([0, 0.5 * T, 1.5 * T, 0.5 * T], rel=1e-4)
    assert curve.end.mean - curve.end.low == pytest.approx(0.5 * T, rel=1e-4)


def test_an_excluded_plan_is_left_out_of_all_runs_and_counted():
    refused = make_plan_record("a", 1, (10, 20), excluded="refused")
    curves = plan_curves(
        [make_plans_run("m", [PLANS[0], refused, PLANS[2]]), make_plans_run("n", PLANS)]
    )
    for label in "mn":
        assert curve_of(curves, label).places == (0, 10, 30)
        assert means(curve_of(curves, label)) == [0, 0.5, 2.5]
    assert [run.counts["plans"] for run in curves.runs] == [2, 2, 2]
    assert any(note.endswith("refuses their expert: 1") for note in curves.notes)


def test_plans_without_a_result_are_left_out_and_those_not_come_to_earn_nothing():
    records = [
        make_plan_record("a", 0, (0, 10), 1.0),
        make_plan_record("a", 1, (10, 20), 9.0, failure="out of memory"),
        make_plan_record("a", 2, (20, 40), ended=NOT_ATTEMPTED),
    ]
    curves = plan_curves([make_plans_run("m", records)])
    assert means(curve_of(curves, "m")) == [0, 1, 1]
    assert curve_of(curves, "m").places == (0, 10, 40)
    run = curves.runs[0]
    assert run.counts == {"plans": 2, "not attempted": 1}
    assert "left out, as they failed or were not asked in a run: 1" in curves.notes
    assert curves.n_trajectories == 1
    assert curve_of(curves, "m").end.low is None
    assert "a mean over one trajectory has no interval" in curves.notes


def test_a_final_task_begins_where_its_first_plan_does():
    curve = curve_of(
        plan_curves([make_plans_run("m", [make_plan_record("a", 7, (300, 310), 1.0)])]), "m"
    )
    assert (curve.places, means(curve)) == ((300, 310), [0, 1])


def test_tokens_are_those_of_the_envelope_or_of_the_last_step():
    records = [
        make_plan_record("a", 0, (0, 10), 1.0, context=500),
        make_plan_record("a", 1, (10, 20), 2.0, context_of_step=900),
    ]
    curve = curve_of(plan_curves([make_plans_run("m", records)]), "m", Axis.TOKENS)
    assert (curve.places, means(curve)) == ((500, 900), [1, 3])


def test_a_run_that_tells_no_tokens_has_no_curve_over_them():
    with_tokens = make_plans_run("m", [make_plan_record("a", 0, (0, 10), 1.0, context=500)])
    without = make_plans_run("n", [make_plan_record("a", 0, (0, 10), 3.0)])
    curves = plan_curves([with_tokens, without])
    axes = [list(run.curves) for run in curves.runs[:2]]
    assert axes == [[Axis.STEPS, Axis.TOKENS], [Axis.STEPS]]
    assert "context tokens are not reported: n" in curves.notes


@pytest.mark.parametrize("bound", ["planner", AT_MOST])
def test_the_bound_over_tokens_is_where_the_first_of_the_runs_has_each_plan(bound):
    def make_records(*contexts):
        return [
            make_plan_record("a", n, (10 * n, 10 * n + 10), 1.0, most=3.0 + n, context=context)
            for n, context in enumerate(contexts)
        ]

    runs = [
        make_plans_run("m", make_records(500, 800, 1400)),
        make_plans_run("n", make_records(480, None, 1500)),
    ]
    planned = [
        make_plan_record("a", number, (10 * number, 10 * number + 10), 3.0 + number)
        for number in range(3)
    ]
    curves = plan_curves([*runs, make_planner_run(planned)] if bound == "planner" else runs)
    curve = curve_of(curves, bound, Axis.TOKENS)
    assert [curve.places[0], curve.places[-1]] == [480, 1400]
    assert dict(zip(curve.places, means(curve), strict=True)) == {480: 3, 500: 3, 800: 7, 1400: 12}
    assert any(
        note.startswith(f"{bound}, context of the plan's last request") for note in curves.notes
    )


def test_the_planner_is_the_bound_and_comes_last():
    curves = plan_curves([make_planner_run(PLANS), make_plans_run("m", PLANS)])
    assert [(run.label, run.is_bound) for run in curves.runs] == [("m", False), ("planner", True)]


def test_of_several_planners_none_is_the_bound():
    worse = [
        make_plan_record("a", 0, (0, 10), 0.5, most=1.0),
        *(replace_most(record) for record in PLANS[1:]),
    ]
    planners = [
        make_planner_run(list(map(replace_most, PLANS)), label="one"),
        make_planner_run(worse, label="two"),
    ]
    curves = plan_curves(planners)
    labels = [("one", False), ("two", False), (AT_MOST, True)]
    assert [(run.label, run.is_bound) for run in curves.runs] == labels
    assert means(curve_of(curves, AT_MOST)) == [0, 0.5, 1.5, 3.5]


def test_without_a_planner_the_bound_is_what_the_rules_allow():
    one = [
        make_plan_record("a", 0, (0, 10), 1.0, most=2.0),
        make_plan_record("a", 1, (10, 20), ended=NOT_ATTEMPTED),
    ]
    two = [
        make_plan_record("a", 0, (0, 10), 0.0, most=2.0),
        make_plan_record("a", 1, (10, 20), 1.0, most=3.0),
    ]
    curves = plan_curves([make_plans_run("one", one), make_plans_run("two", two)])
    assert curves.runs[-1].is_bound
    assert means(curve_of(curves, AT_MOST)) == [0, 2, 5]
    assert not any(AT_MOST in note for note in curves.notes)
    alone = plan_curves([make_plans_run("one", one)])
    assert means(curve_of(alone, AT_MOST)) == [0, 2, 2]
    assert "plans that no run attempted, which add nothing to 'at most': 1" in alone.notes


def test_only_trajectories_that_all_runs_have_in_full_are_drawn():
    stopped_amid_a = [
        make_plan_record("a", 0, (0, 10), 7.0),
        make_plan_record("b", 0, (0, 30), 2.0),
        make_plan_record("c", 0, (0, 30), 2.0),
    ]
    curves = plan_curves([make_plans_run("m", PLANS), make_plans_run("n", stopped_amid_a)])
    assert curves.n_trajectories == 1
    assert (means(curve_of(curves, "m"))[-1], means(curve_of(curves, "n"))[-1]) == (4, 2)
    assert curves.notes[0].startswith("1 of 3 trajectories are drawn")


def test_a_long_grid_is_thinned_and_keeps_its_ends():
    many = [make_plan_record("a", index, (index, index + 1), 1.0) for index in range(1000)]
    curve = curve_of(plan_curves([make_plans_run("m", many)]), "m")
    assert len(curve.places) == 400
    assert (curve.places[0], curve.places[-1], curve.end.mean) == (0, 1000, 1000)


def test_runs_differ_in_simulator_and_course_in_a_note():
    other = make_plans_run("n", PLANS, simulator="unity", after_failure="stop")
    notes = "\n".join(plan_curves([make_plans_run("m", PLANS), other]).notes)
    assert "simulator: embedded (m), unity (n)" in notes
    assert "after a failed plan: continue (m), stop (n)" in notes


REFUSED = {
    "another task": (
        make_plans_run("n", [make_plan_record("a", 0, (0, 10), task="other")], task="other"),
        r"m and n share no task \(m has infthor_plans, n has other\)",
    ),
    "another trajectory": (
        make_plans_run("n", [make_plan_record("z", 0, (0, 10))]),
        r"share no trajectory .*\(m has 0 of 1 episodes of z, n has 0 of 2 episodes of a\); finish",
    ),
    "a part of the only trajectory": (
        make_plans_run("n", [make_plan_record("a", 0, (0, 10))]),
        r"\(n has 1 of 2 episodes of a\); finish them, or draw runs on the same data",
    ),
    "other rules": (
        make_plans_run("n", PLANS, rewards={"name": "published"}),
        "different reward rules",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_drawn_together_is_refused(case):
    other, expected = REFUSED[case]
    with pytest.raises((DataError, UsageError), match=expected):
        plan_curves([make_plans_run("m", PLANS), other])


def test_of_several_shared_tasks_one_is_to_be_named():
    run = make_plans_run("m", PLANS)
    run.config.tasks["other"] = run.config.tasks[TASK]
    with pytest.raises(UsageError, match=f"--task: {TASK}, other"):
        plan_curves([run])
    assert plan_curves([run], TASK).task == TASK
    with pytest.raises(UsageError, match="unknown task of all these runs 'x'"):
        plan_curves([run], "x")


def test_a_journal_of_another_form_is_refused(tmp_path):
    run = make_plans_run("m", PLANS)
    folder = write_journal(tmp_path / "run", run.header, run.records, RECORDS)
    spoil_config(folder)
    with pytest.raises(DataError, match="line 1: not the config of a run of plans"):
        Run.open(folder).read()
