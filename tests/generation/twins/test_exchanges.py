"""Which objects may exchange places."""

import random
from collections import Counter
from dataclasses import replace

import pytest

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.twins.episode import read_episode
from infthor_eval.generation.twins.exchanges import Swap
from infthor_eval.generation.twins.task_shares import task_shares
from infthor_eval.thor.restore import restore


@pytest.fixture(scope="module")
def trajectory(file):
    return next(iter_trajectories(file))


@pytest.fixture(scope="module")
def episode(trajectory, simulator):
    return read_episode(trajectory, simulator)


def test_tasks_name_what_more_can_be_done_with_more_often(trajectory, simulator):
    restore(simulator, trajectory.scene)
    shares = task_shares(simulator.view, trajectory.scene.floor_plan)
    # A kitchen heats, cools, cleans and stacks mugs; shakers it only puts somewhere.
    assert shares["Mug"] > 3 * shares["SaltShaker"]
    assert shares == task_shares(simulator.view, trajectory.scene.floor_plan)


def test_what_tasks_name_more_often_is_not_carried_in_one_world_alone(episode):
    pairs = Swap().pairs(episode, random.Random(0))
    assert pairs
    for one, other in pairs:
        low, high = sorted(episode.task_shares[obj.object_type] for obj in (one, other))
        assert low >= high / 2 > 0


def test_what_no_task_names_is_exchanged_with_nothing(episode):
    bare = replace(episode)
    vars(bare)["task_shares"] = Counter()
    assert not Swap().pairs(bare, random.Random(0))
