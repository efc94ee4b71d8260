"""Rewards of going somewhere."""

import pytest

from infthor_eval.household.navigation import GridPose
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.rewards import PlanReward, count_actions_to_goal, max_reward
from infthor_eval.plans.targets import PlanTarget

from .building import CORRIDOR, kitchen
from .rewarding import DEFAULT, DONE, ELSEWHERE, GOES_ON, PICKUP, run


def walk(rules, poses, actions, goal=(0, 9), start=(0, 0), horizon=30.0, goal_horizon=30.0):
    """Rewards of walking through the corridor, at cells along it."""
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose(goal, 0), goal_horizon=goal_horizon)
    events = [(action, None, kitchen(at=(0, z))) for action, z in zip(actions, poses, strict=True)]
    return run(rules, target, kitchen(at=start, horizon=horizon), events, grid=CORRIDOR)


AHEAD = "MoveAhead"


def test_goto_pays_steps_and_arrival():
    rewards = walk(DEFAULT, [1, 2, 3, 4, 5, 6, 7], [AHEAD] * 7)
    # Six to go, then 5, 4 and exactly 3 left: not there yet. At two left it is done.
    assert rewards == [(pytest.approx(0.2), GOES_ON)] * 6 + [(pytest.approx(4.2), DONE)]


def test_a_way_of_exactly_three_is_not_there():
    assert walk(DEFAULT, [6], [AHEAD], start=(0, 5)) == [(pytest.approx(0.2), GOES_ON)]
    assert walk(DEFAULT, [7], [AHEAD], start=(0, 6)) == [(pytest.approx(4.2), DONE)]


def test_to_and_fro_is_paid_once():
    actions = [AHEAD, "Teleport", AHEAD, AHEAD]
    assert walk(DEFAULT, [1, 0, 1, 2], actions) == [
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(0.2), GOES_ON),
    ]


def test_looks_and_turns_are_steps():
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 2), 90), goal_horizon=60.0)
    start = kitchen(at=(0, 0), horizon=-30.0)  # two ahead, one turn, three looks: six left
    events = [
        ("LookDown", None, kitchen(at=(0, 0), horizon=0.0)),
        ("RotateLeft", None, kitchen(at=(0, 0), facing=270, horizon=0.0)),  # worse
        ("RotateRight", None, kitchen(at=(0, 0), horizon=0.0)),
        ("MoveAhead", None, kitchen(at=(0, 1), horizon=0.0)),
        ("LookDown", None, kitchen(at=(0, 1), horizon=30.0)),
        # One ahead is lost behind turns.
        ("RotateRight", None, kitchen(at=(0, 1), facing=90, horizon=30.0)),
        ("LookDown", None, kitchen(at=(0, 1), facing=0, horizon=60.0)),
    ]
    assert run(DEFAULT, target, start, events, grid=CORRIDOR) == [
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(0.0), GOES_ON),
        (pytest.approx(0.2), GOES_ON),
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(4.2), DONE),
    ]


def test_half_a_look_counts_whole():
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 2), 0), goal_horizon=45.0)
    events = [("MoveAhead", None, kitchen(at=(0, 1), horizon=30.0))]  # one ahead and half a look
    assert run(DEFAULT, target, kitchen(), events, grid=CORRIDOR) == [(pytest.approx(4.2), DONE)]
    assert max_reward(DEFAULT, target, kitchen(horizon=30.0), CORRIDOR) == pytest.approx(4.2)


def test_who_starts_there_must_still_act():
    assert walk(DEFAULT, [9], ["NoOp"], start=(0, 9)) == [(0.0, GOES_ON)]
    assert walk(DEFAULT, [8], [AHEAD], start=(0, 7)) == [(pytest.approx(4.2), DONE)]


def test_no_way_there_pays_nothing():
    assert walk(DEFAULT, [1], [AHEAD], goal=(7, 7)) == [(0.0, GOES_ON)]


def test_a_way_is_over_before_its_end_and_other_plans_go_on():
    poses = [kitchen(at=(0, z)).agent for z in range(1, 8)]
    ahead = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 7), 0), goal_horizon=30.0)
    assert count_actions_to_goal(DEFAULT, ahead, poses, CORRIDOR) == 5  # two steps are left
    assert count_actions_to_goal(DEFAULT, ahead, poses[:4], CORRIDOR) == 4
    assert count_actions_to_goal(DEFAULT, PICKUP, poses) == len(poses)


def test_a_way_needs_the_grid():
    with pytest.raises(ValueError, match="needs the grid"):
        PlanReward(
            DEFAULT, PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 9), 0)), ELSEWHERE, kitchen()
        )
