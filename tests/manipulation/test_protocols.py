"""Ways in which an episode can begin, and when a policy's hand closes in it."""

import pytest

from infthor_eval.runs import execute
from model_adapters import ArmDelta

from ..helpers.trajectories import MUG, cut_trajectory, write_trajectories

pytestmark = pytest.mark.usefixtures("shared_simulators")

TWIN = "openvla-tiny"  # whose place a scripted policy takes
PICK, PUT = "manipulathor_pickup", "manipulathor_put"
OPEN = ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.9)


@pytest.fixture
def picking(prepare_run, policy, tmp_path):
    """The record of a pick-up of a clock beside the expert, by a policy that holds its hand still
    and open."""
    data = write_trajectories(tmp_path / "clock", cut_trajectory(MUG, 6))

    def picking(model=TWIN, **changes):
        if model == TWIN:
            policy(lambda _: [OPEN])
        *_, record = execute(prepare_run(model, tasks=(PICK,), data=data, **changes)).records
        assert not record.failure and not record.excluded
        return record.payload

    return picking


def test_a_hand_closes_when_it_is_asked_always_or_at_the_end(picking):
    when_asked, always, end = (picking(closing=closing) for closing in ("asked", "always", "end"))
    assert when_asked.starts_inside  # with a sphere of half a metre
    assert (when_asked.ended, len(when_asked.steps)) == ("step limit", 60)
    assert (always.ended, len(always.steps)) == ("done", 1)
    assert (end.ended, len(end.steps)) == ("done", 61)
    assert [call["action"] for call in end.steps[-1].calls] == ["PickupObject"]


def test_at_the_end_a_hand_may_close_around_nothing(picking):
    payload = picking(closing="end", radius="0.04")
    assert (payload.ended, payload.steps[-1].calls) == ("step limit", ())


def test_before_the_way_there_the_object_is_farther_off(picking):
    near, far = (picking("still", stand=stand) for stand in ("expert", "before"))
    assert (near.ended, near.starts_inside) == ("done", True)
    assert (far.ended, far.starts_inside) == ("gave up", False)
    assert far.start_distance > near.start_distance + 0.5


def test_the_hand_begins_at_rest_low_or_high(picking):
    heights = {
        hand: picking("still", hand=hand).steps[0].hand[1] for hand in ("rest", "low", "high")
    }
    assert heights["low"] < heights["rest"] - 0.05 < heights["rest"] + 0.05 < heights["high"]


def test_a_put_counts_at_rest_or_when_it_is_released(prepare_run, policy):
    policy(lambda _: [OPEN])

    def put(**changes):
        (record,) = execute(prepare_run(TWIN, tasks=(PUT,), **changes)).records
        return record.payload

    usual, lenient = put(), put(put_criterion="release")
    assert usual.ended == lenient.ended == "released elsewhere"
    assert (usual.done, usual.reward) == (False, 0.0)
    assert (lenient.done, lenient.reward) == (True, lenient.max_reward)


@pytest.mark.parametrize(
    "changes",
    [{"stand": "before"}, {"hand": "high"}, {"closing": "end"}, {"put_criterion": "release"}],
)
def test_each_is_another_run(prepare_run, changes):
    def config(**changes):
        run = prepare_run("still", **changes)
        return run.evaluation.bind(run.suite.baselines["still"](0)).workload.config

    assert config() != config(**changes)
