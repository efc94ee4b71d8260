"""Which objects may exchange places."""

import random
from collections import Counter
from dataclasses import replace

import pytest

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.twins.exchanges import Move, Swap, Untouched
from infthor_eval.generation.twins.task_shares import task_shares
from infthor_eval.household.affordances import goes_into
from infthor_eval.thor.restore import restore


@pytest.fixture(scope="module")
def trajectory(file):
    return next(iter_trajectories(file))


@pytest.fixture(scope="module")
def episode(living_room):
    return living_room


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


def test_a_world_half_as_likely_is_proposed_half_as_often(episode):
    one, other = Swap().pairs(episode, random.Random(0))[0]
    carried, left = (one, other) if episode.actions_on(one.object_id) else (other, one)
    unequal = replace(episode)
    shares = Counter({carried.object_type: 60, left.object_type: 30})
    vars(unequal)["task_shares"] = shares
    rng = random.Random(0)
    edits = [edit for _ in range(400) for edit in Swap().propose(unequal, rng)]
    both = {one.object_id, other.object_id}

    def count(edits):
        return sum({edit.one.object_id, edit.other.object_id} == both for edit in edits)

    n_same = count(edits)
    assert 160 < n_same < 240
    shares[carried.object_type] = 20
    again = [edit for _ in range(20) for edit in Swap().propose(unequal, rng)]
    assert count(again) == 20


def test_only_swaps_are_drawn_by_how_likely_they_are(episode):
    one, other = episode.loose[:2]
    assert Move().chance(episode, one, other) == 1.0


def test_the_reverse_of_each_exchange_could_be_proposed_as_well(episode):
    rng = random.Random(0)
    pairs = [pair for kind in (Move(), Swap(), Untouched()) for pair in kind.pairs(episode, rng)]
    assert pairs
    places = [(obj, episode.holder(obj.object_id)) for pair in pairs for obj in pair]
    assert all(goes_into(obj.object_type, place.object_type) for obj, place in places)
    # A simulator puts some things where the published table has none.
    others = [obj for obj in episode.loose if episode.holder(obj.object_id)]
    assert any(
        not goes_into(obj.object_type, episode.holder(obj.object_id).object_type) for obj in others
    )
