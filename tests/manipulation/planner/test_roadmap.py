"""Finding a way for an arm among solids, without a simulator."""

import math

import numpy as np
import pytest

from infthor_eval.manipulation.geometry import Corners
from infthor_eval.manipulation.planner.linkage import (
    Linkage,
    Poses,
    angles_of,
    heading,
    rotations_about,
)
from infthor_eval.manipulation.planner.obstacles import clearances, obstacles_of
from infthor_eval.manipulation.planner.roadmap import Contact, MoveKind, Roadmap, Terrain
from infthor_eval.thor.view import ArmJoint, ArmState, AxisAngle, Vector

from .test_places import thing

FOOT, BASE = 0.3, 1.0  # metres that the shoulder is ahead of the base, and heights of the base
UPPER, FORE = 0.3, 0.3
NOW = (0.0, 1.0, 0.7)  # where the wrist is; what is held is 0.2 m ahead of it


def joint(x, y, z):
    nothing = AxisAngle()
    return ArmJoint("a", Vector(x, y, z), Vector(), nothing, nothing, nothing)


@pytest.fixture
def linkage():
    """An arm along z whose elbow is above it."""
    elbow = (0.0, BASE + math.sqrt(UPPER**2 - 0.2**2), FOOT + 0.2)
    joints = [joint(0, BASE, 0), joint(0, BASE, FOOT), joint(*elbow), joint(*NOW)]
    arm = ArmState(joints, ["Egg|1"], [], [], Vector(0.0, 1.0, 0.9), 0.1)
    return Linkage(arm, thing("Egg|1", 0.0, 1.0, 0.9, (0.06, 0.06, 0.06)))


def pose(x=0.0, y=0.0, z=0.7, base=BASE, yaw=0.0):
    return Poses(np.array([(x, y, z)]), np.array([base]), heading(np.radians([yaw]), np.zeros(1)))


def wall(low, high):
    return obstacles_of([("Wall", Corners(low, high))])


# The hand can reach over it or past it on the right.
BEFORE_IT = wall((-0.5, 0.0, 0.97), (0.1, 1.5, 0.99))


def draws(count):
    random = np.random.default_rng(3)
    wrists = np.array([0.0, 0.0, FOOT]) + random.uniform(-0.5, 0.5, size=(count, 3))
    turns = heading(random.uniform(-1.5, 1.5, size=count), np.zeros(count))
    return Poses(wrists, random.uniform(0.5, 1.8, size=count), turns)


def test_the_arm_is_where_it_was_measured(linkage):
    parts = linkage.parts(linkage.now)
    assert parts.center[0, 1] == pytest.approx([0, BASE + 0.5 * math.sqrt(0.05), FOOT + 0.1])
    assert parts.center[0, 3] == pytest.approx(NOW)
    assert parts.center[0, 4] == pytest.approx([0.0, 1.0, 0.9])
    assert parts.half[0, 1, 2] == pytest.approx(UPPER / 2)


def test_links_keep_their_length_and_what_is_held_turns_with_the_hand(linkage):
    parts = linkage.parts(pose(x=0.3, y=0.1, z=0.5, base=1.4, yaw=90))
    assert parts.half[0, 1:3, 2] == pytest.approx([UPPER / 2, FORE / 2])
    assert parts.center[0, 4] == pytest.approx([0.5, 1.5, 0.5])  # 0.2 m to the right of the wrist
    assert linkage.can_reach(pose(z=FOOT + 0.59)) and not linkage.can_reach(pose(z=FOOT + 0.61))


def test_angles_are_those_that_a_hand_is_turned_by():
    pitch, yaw, roll = angles_of(heading(np.radians([40.0]), np.radians([25.0]))[0])
    assert (pitch, yaw, roll) == pytest.approx((25.0, 40.0, 0.0))
    tilted = (
        heading(np.radians([10.0]), np.radians([20.0]))[0]
        @ rotations_about(np.array([0, 0, 1.0]), np.radians([-30.0]))[0]
    )
    assert angles_of(tilted) == pytest.approx((20.0, 10.0, 30.0))


def test_a_free_way_is_one_movement_of_each_kind(linkage):
    free = Terrain(linkage, obstacles_of(()), [])
    moves, _ = free.movements(linkage.now, pose(x=0.1, base=1.2, yaw=30))
    assert sorted(move.kind for move in moves) == [MoveKind.LIFT, MoveKind.REACH, MoveKind.TURN]
    assert moves[-1].pose.world()[0] == pytest.approx([0.1, 1.2, 0.7])


def test_movements_are_made_in_an_order_in_which_nothing_is_met(linkage):
    terrain = Terrain(linkage, BEFORE_IT, [])
    moves, _ = terrain.movements(linkage.now, pose(z=0.88, base=1.7))
    assert [move.kind for move in moves] == [MoveKind.LIFT, MoveKind.REACH]
    none, met = terrain.movements(linkage.now, pose(z=0.88))
    assert none is None
    # Where it comes to the wall.
    assert linkage.held_box(met).center[0, 0, 2] == pytest.approx(0.95, abs=0.09)


def test_a_roadmap_goes_around_what_is_straight_ahead(linkage):
    terrain = Terrain(linkage, BEFORE_IT, [])
    end = pose(x=-0.1, z=0.87)
    assert terrain.movements(linkage.now, end)[0] is None
    others = Poses.join([draws(100), pose(x=-0.1, z=0.87, base=1.65)])  # the last is above it
    moves = Roadmap(terrain, others[terrain.free(others)], end, np.zeros(1)).find_path()
    now = linkage.now
    for move in moves:
        steps, _ = terrain.movements(now, move.pose)
        assert [step.kind for step in steps] == [move.kind]
        assert clearances(linkage.parts(move.pose), BEFORE_IT).min() > 0
        now = move.pose
    assert len(moves) > 2
    assert now.world()[0] == pytest.approx(end.world()[0])


@pytest.mark.parametrize("costs", [(0.0, 1.0), (1.0, 0.0)])
def test_of_several_ends_the_cheapest_is_come_to(linkage, costs):
    ends = Poses.join([pose(x=0.1), pose(x=-0.1)])
    free = Terrain(linkage, obstacles_of(()), [])
    (move,) = Roadmap(free, draws(20), ends, np.array(costs)).find_path()
    assert move.pose.wrists[0, 0] == ends.wrists[costs.index(0.0), 0]


def test_there_is_no_way_into_what_is_shut(linkage):
    shut = wall((-2.0, -2.0, 0.97), (2.0, 4.0, 0.99))
    end = pose(z=0.87)
    assert Roadmap(Terrain(linkage, shut, []), draws(50), end, np.zeros(1)).find_path() is None


def test_what_was_met_is_not_tried_again(linkage):
    goal, free = pose(x=0.3, z=0.75), obstacles_of(())
    assert Terrain(linkage, free, []).free(goal).all()
    on_it = Contact(goal.world()[0], linkage.held_box(goal).center[0, 0])
    assert not Terrain(linkage, free, [on_it]).free(goal).any()
    elsewhere = Contact(goal.world()[0], linkage.held_box(pose(x=0.3, z=0.75, yaw=90)).center[0, 0])
    # The hand was turned otherwise there.
    assert Terrain(linkage, free, [elsewhere]).free(goal).all()


def test_what_is_in_a_thing_may_get_out_of_it_but_not_deeper(linkage):
    around = wall((-0.2, 0.9, 0.86), (0.2, 1.1, 1.4))  # what is held is 7 cm deep in it
    out, deeper = pose(z=0.6), pose(z=0.75)
    terrain = Terrain(linkage, around, [])
    assert terrain.movements(linkage.now, out)[0] and not terrain.movements(linkage.now, deeper)[0]


@pytest.mark.parametrize("escapes", [False, True])
def test_through_what_it_is_in_an_arm_escapes_only_where_that_is_believed(linkage, escapes):
    board = wall((-0.2, 0.9, 0.86), (0.2, 0.995, 1.4))  # what is held is 2.5 cm deep in it
    terrain = Terrain(linkage, board, [], escapes=escapes)
    assert bool(terrain.movements(linkage.now, pose(base=0.8))[0]) == escapes
