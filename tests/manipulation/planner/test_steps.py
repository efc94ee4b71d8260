"""Poses in which to let go, and poses to pass on the way there."""

import numpy as np
import pytest

from infthor_eval.manipulation.geometry import Corners
from infthor_eval.manipulation.planner.linkage import ArmStand
from infthor_eval.manipulation.planner.obstacles import obstacles_of
from infthor_eval.manipulation.planner.places import Entry, Places, support
from infthor_eval.manipulation.planner.roadmap import Contact, Terrain
from infthor_eval.manipulation.planner.steps import PutGoal, passing_poses, release_poses

from .test_places import lattice
from .test_roadmap import linkage

__all__ = ["linkage"]

STAND = ArmStand(0.451, 1.801, 0.0)
ACROSS, AHEAD = np.arange(-0.275, 0.3, 0.05), np.arange(0.825, 1.1, 0.05)


def goal(others=(), entry=None, **changes):
    """A board 0.6 m wide before the arm, at 0.8 m."""
    places = {"points": lattice(ACROSS, AHEAD, (0.8,)), "spacing": 0.05, "top": 0.8, **changes}
    return PutGoal(Places(**places), entry, list(others))


def ends(linkage, goal_places, contacts=(), obstacles=()):
    terrain = Terrain(linkage, obstacles_of(obstacles), list(contacts))
    released = release_poses(goal_places, terrain, STAND, np.random.default_rng(0))
    return released, linkage.held_box(released.poses)


def bottoms(held):
    return held.center[:, 0, 1] - (np.abs(held.axes[:, 0, :, 1]) * held.half[:, 0]).sum(axis=1)


def test_things_are_let_go_low_above_the_inner_part_of_a_board(linkage):
    board = goal()
    released, held = ends(linkage, board)
    assert len(released.poses) and (np.diff(released.costs) >= 0).all()
    assert (support(held, board.places) == 1.0).all()
    assert bottoms(held) == pytest.approx(0.82)
    assert np.abs(held.center[:, 0, 0]).max() < 0.26
    assert ((released.poses.bases >= STAND.low) & (released.poses.bases <= STAND.high)).all()


def test_things_are_let_go_above_a_rim_and_in_what_is_entered_below_its_ceiling(linkage):
    _, held = ends(linkage, goal(top=1.1))
    assert bottoms(held).min() >= 1.1
    inside = goal(top=1.1, entered=True, entry=Entry(2, -1, 0.8))
    _, held = ends(linkage, inside)
    assert bottoms(held).min() > 0.8 and bottoms(held).max() < 1.1


def test_the_higher_things_are_around_the_higher_it_is_let_go(linkage):
    wall = [("Sofa|1", Corners((-2.0, 0.0, 0.6), (2.0, 1.0, 1.4)))]
    _, held = ends(linkage, goal(), obstacles=wall)
    assert len(held.center) and bottoms(held).min() >= 1.0


def test_nothing_is_let_go_on_other_things_while_there_is_room(linkage):
    left = Corners((-0.3, 0.8, 0.8), (0.0, 0.9, 1.1))
    _, held = ends(linkage, goal([left]))
    assert held.center[:, 0, 0].min() > 0.03
    everywhere = Corners((-0.3, 0.8, 0.8), (0.3, 0.9, 1.1))
    assert len(ends(linkage, goal([everywhere]))[0].poses)


@pytest.mark.parametrize("on_goal", [True, False])
def test_where_an_opening_was_met_on_one_side_another_is_entered(linkage, on_goal):
    board = goal(top=1.3, entered=True, entry=Entry(2, -1, 0.8))
    _, before = ends(linkage, board)
    side = float(np.median(before.center[:, 0, 0]))
    met = [Contact(np.array([side, 1.0, 0.3]), np.array([side, 1.0, 0.7]), on_goal)]
    _, after = ends(linkage, board, met)
    assert (np.abs(after.center[:, 0, 0] - side).min() >= 0.06) == on_goal


def test_places_that_are_too_far_have_no_ends(linkage):
    assert not len(ends(linkage, goal(points=lattice(ACROSS, AHEAD + 3.0, (0.8,))))[0].poses)


def test_poses_to_pass_are_free_and_some_are_before_the_opening(linkage):
    board = goal(top=1.3, entered=True, entry=Entry(2, -1, 0.8))
    below = [("Floor|1", Corners((-5.0, -1.0, -5.0), (5.0, 0.9, 5.0)))]
    terrain = Terrain(linkage, obstacles_of(below), [])
    released, _ = ends(linkage, board, obstacles=below)
    others = passing_poses(board, terrain, STAND, released.poses, 50, np.random.default_rng(0))
    assert len(others) > 100 and terrain.free(others).all()
    before = released.poses.wrists[0] + np.array([0.0, 0.02, -0.12])
    assert (np.abs(others.wrists - before).max(axis=1) < 1e-9).any()


def test_equal_draws_give_equal_poses(linkage):
    first, again = (ends(linkage, goal())[0] for _ in range(2))
    assert (first.poses.wrists == again.poses.wrists).all() and (first.costs == again.costs).all()
