"""Success by radius, with numbers made by hand."""

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.manipulation.recorded.radii import success_by_radius

from ...helpers.arm_runs import make_arm_planner_run, make_arm_run, make_episode_record


def episodes(done: int, inside: int = 0):
    """Four pick-ups and four puts of two trajectories, of each kind so many with success."""
    places = list(enumerate((name, 10 * number) for name in "ab" for number in range(2)))
    pick_ups = [make_episode_record(*at, done=n < done, inside=n < inside) for n, at in places]
    puts = [make_episode_record(name, at + 5, "put", done=n < done) for n, (name, at) in places]
    return pick_ups + puts


def means(points):
    return [(radius, rate.mean, rate.n) for radius, rate in points]


def test_a_line_per_model_and_kind_with_the_planner_last():
    runs = [
        make_arm_planner_run(episodes(4), radius=0.5),
        make_arm_run("m", episodes(3, 2), radius=0.5),
        make_arm_run("m", episodes(1, 1), radius=0.06),
    ]
    by_radius = success_by_radius(runs)
    assert [(line.label, line.kind, line.is_bound) for line in by_radius.lines] == [
        ("m", "pickup", False),
        ("planner-arm", "pickup", True),
        ("m", "put", False),
        ("planner-arm", "put", True),
    ]
    assert means(by_radius.lines[0].points) == [(0.06, 0.25, 4), (0.5, 0.75, 4)]
    assert all(0 <= rate.low < rate.mean < rate.high <= 1 for _, rate in by_radius.lines[0].points)
    assert by_radius.notes == ()


def test_the_floor_is_the_share_that_lies_in_the_sphere_at_the_start():
    runs = [
        make_arm_run("m", episodes(4, 3), radius=0.5),
        make_arm_run("m", episodes(2, 1), radius=0.1),
    ]
    assert means(success_by_radius(runs).floor) == [(0.1, 0.25, 4), (0.5, 0.75, 4)]
    assert success_by_radius(runs, "arm_put").floor == ()


def test_an_episode_that_failed_in_one_run_is_left_out_of_all():
    failed = [make_episode_record("a", 0, failure="broken"), *episodes(4, 4)[1:]]
    runs = [make_arm_run("m", failed), make_arm_run("n", episodes(0, 4))]
    by_radius = success_by_radius(runs)
    assert means(by_radius.floor) == [(0.5, 1.0, 3)]
    assert means(by_radius.lines[0].points) == [(0.5, 1.0, 3)]


def test_episodes_that_a_radius_excludes_are_left_out_of_all():
    refused = [make_episode_record("a", 0, excluded="no room"), *episodes(0)[1:]]
    by_radius = success_by_radius(
        [make_arm_run("m", episodes(4)), make_arm_run("m", refused, radius=0.06)]
    )
    assert means(by_radius.lines[0].points) == [(0.06, 0.0, 3), (0.5, 1.0, 3)]


def test_two_runs_of_one_model_and_radius_are_refused():
    with pytest.raises(
        UsageError,
        match=r"two runs are called m and have a radius of 0\.5 m; leave one of them out",
    ):
        success_by_radius([make_arm_run("m", episodes(1)), make_arm_run("m", episodes(2))])
