"""Curves of arms, with numbers made by hand."""

import pytest

from infthor_eval.episodes.curves import AT_MOST
from infthor_eval.errors import DataError, UsageError
from infthor_eval.manipulation.recorded.curves import ALL, arm_curves
from infthor_eval.manipulation.recorded.runs import label_by_radius
from infthor_eval.manipulation.records import RECORDS
from infthor_eval.run import Run
from infthor_eval.runs.journals.journal import Journal

from ...helpers.arm_runs import make_arm_planner_run, make_arm_run, make_episode_record
from ...helpers.journals import spoil_config

T = 12.7062  # quantile of the t interval over two trajectories
# Two trajectories: of a pick-up and a put, and of a pick-up.
EPISODES = (
    make_episode_record("a", 10),
    make_episode_record("a", 20, "put"),
    make_episode_record("b", 30),
)
FAILED_PUT = (EPISODES[0], make_episode_record("a", 20, "put", done=False), EPISODES[2])


def curve_of(curves, label, facet=ALL):
    (run,) = [run for run in curves.runs if run.label == label]
    return run.curves[facet]


def bound_last(*labels):
    """Runs by their labels, of which the last is the bound."""
    return [(label, label == labels[-1]) for label in labels]


def means(curve):
    return [estimate.mean for estimate in curve.means]


def test_reward_adds_up_over_the_experts_steps_and_the_expert_takes_over_what_failed():
    curves = arm_curves(
        [make_arm_run("m", [make_episode_record("a", 5, done=False), *EPISODES[:2]])]
    )
    curve = curve_of(curves, "m")
    assert (curve.places, means(curve)) == ((0, 5, 10, 20), [0, 0, 2, 4])
    assert means(curve_of(curves, AT_MOST)) == [0, 2, 4, 6]


def test_both_kinds_are_drawn_together_and_each_by_itself_over_the_same_trajectories():
    curves = arm_curves([make_arm_run("m", EPISODES)])
    assert list(curves.facets) == [ALL, "pickup", "put"]
    titles = [facet.title for facet in curves.facets.values()]
    assert titles == ["Pick-up and put", "Pick-up", "Put"]
    both, pickups, puts = (curve_of(curves, "m", facet) for facet in curves.facets)
    assert (both.places, means(both)) == ((0, 10, 20, 30), [0, 1, 2, 3])
    assert (pickups.places, means(pickups)) == ((0, 10, 30), [0, 1, 2])
    # Of the second trajectory, which has no put, there is nothing: the kinds add up to both.
    assert (puts.places, means(puts)) == ((0, 20), [0, 1])
    assert both.end.high - both.end.mean == pytest.approx(1.0 * T, rel=1e-4)
    assert curves.n_trajectories == 2


def test_of_one_kind_there_is_one_curve():
    curves = arm_curves([make_arm_run("m", [EPISODES[0], EPISODES[2]])])
    assert list(curves.facets) == ["pickup"]
    assert curves.task == "arm_pickup"
    assert means(curve_of(curves, "m", "pickup")) == [0, 1, 2]


def test_tasks_can_be_chosen():
    runs = [make_arm_run("m", EPISODES)]
    assert list(arm_curves(runs, "arm_put").facets) == ["put"]
    assert list(arm_curves(runs, "arm_put, arm_pickup").facets) == [ALL, "pickup", "put"]
    with pytest.raises(UsageError, match="unknown task of all these runs 'arm'"):
        arm_curves(runs, "arm")


def test_two_tasks_of_one_kind_are_not_drawn_together():
    run = make_arm_run("m", [*EPISODES, make_episode_record("a", 10, task="other_pickup")])
    with pytest.raises(
        UsageError, match="arm_pickup and other_pickup are both of pickup; give one of each kind"
    ):
        arm_curves([run])
    assert arm_curves([run], "arm_pickup,arm_put").task == "arm_pickup and arm_put"


def test_excluded_and_failed_episodes_are_left_out_of_all_runs():
    kept = (EPISODES[2], make_episode_record("a", 25))
    refused = (EPISODES[0], make_episode_record("a", 20, "put", excluded="refused"), *kept)
    failed = (make_episode_record("a", 10, failure="out of memory"), EPISODES[1], *kept)
    curves = arm_curves([make_arm_run("m", refused), make_arm_run("n", failed)])
    for label in ("m", "n", AT_MOST):
        assert means(curve_of(curves, label)) == [0, 1, 2]
    assert [run.counts for run in curves.runs] == [{"episodes": 2}] * 3
    assert any(note.endswith("cannot restore their start: 1") for note in curves.notes)
    assert "left out, as they failed or were not asked in a run: 1" in curves.notes


def test_a_run_that_was_stopped_amid_a_trajectory_does_not_draw_it():
    stopped = [EPISODES[0], EPISODES[2], make_episode_record("c", 3, "put")]
    curves = arm_curves([make_arm_run("m", EPISODES), make_arm_run("n", stopped)])
    assert curves.n_trajectories == 1
    assert means(curve_of(curves, "m")) == [0, 2]
    assert curves.notes[0].startswith("1 of 3 trajectories are drawn")


def test_the_planner_is_the_bound_and_comes_last():
    curves = arm_curves([make_arm_planner_run(FAILED_PUT), make_arm_run("m", EPISODES)])
    assert [(run.label, run.is_bound) for run in curves.runs] == bound_last("m", "planner-arm")


def test_of_several_planners_none_is_the_bound():
    planners = [
        make_arm_planner_run(EPISODES, "p", radius=0.5),
        make_arm_planner_run(FAILED_PUT, "p", radius=0.06),
    ]
    curves = arm_curves(label_by_radius(planners))
    labels = bound_last("p, 0.5 m", "p, 0.06 m", AT_MOST)
    assert [(run.label, run.is_bound) for run in curves.runs] == labels
    assert "the runs differ in the radius of the hand's sphere: 0.06, 0.5 m" in curves.notes
    assert [run.label for run in label_by_radius(planners[:1])] == ["p"]


def test_runs_differ_in_simulator_and_settings_in_a_note():
    other = make_arm_run("n", EPISODES, simulator="unity", settings={"max_steps": 9})
    notes = "\n".join(arm_curves([make_arm_run("m", EPISODES), other]).notes)
    assert "simulator: embedded (m), unity (n)" in notes
    assert "max_steps of arm_put: the default (m), 9 (n)" in notes


def other_digest():
    run = make_arm_run("n", EPISODES)
    for task in run.config.tasks.values():
        task.trajectories.update(dict.fromkeys(task.trajectories, "other"))
    return run


REFUSED = {
    "another task": (
        make_arm_run("n", [make_episode_record("a", 10, task="other")]),
        "m and n share no task",
    ),
    "another trajectory": (
        make_arm_run("n", [make_episode_record("z", 10), make_episode_record("z", 20, "put")]),
        "share no trajectory of arm",
    ),
    "another file": (other_digest(), "share no trajectory of arm.*they have other data"),
    "other rewards": (
        make_arm_run("n", [make_episode_record("a", 10, most=5.0), *EPISODES[1:]]),
        "earn different rewards in arm_pick",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_drawn_together_is_refused(case):
    other, expected = REFUSED[case]
    with pytest.raises((DataError, UsageError), match=expected):
        arm_curves([make_arm_run("m", EPISODES), other])


def test_a_journal_of_another_form_is_refused(tmp_path):
    run = make_arm_run("m", EPISODES)
    with Journal(tmp_path, run.header, RECORDS):
        pass
    spoil_config(tmp_path)
    with pytest.raises(DataError, match="line 1: not the config of a run of manipulation"):
        Run.open(tmp_path).read()
