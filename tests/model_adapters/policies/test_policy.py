"""A network as a policy: what is scaled, averaged, cut, and refused."""

import math

import numpy as np
import pytest

from infthor_eval.errors import DataError, ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters import ArmDelta, FramePolicy, check_adapter, check_options
from model_adapters.options.policies import PolicyOptions
from model_adapters.policies.policy import ExponentialEnsemble, VlaPolicy, arm_deltas
from model_adapters.policies.statistics import ActionStatistics

STATISTICS = ActionStatistics(q01=[-2.0] * 7, q99=[2.0] * 7, mask=[True] * 6 + [False])


class Scripted:
    """Writes what it was given."""

    def __init__(self, chunk):
        self._chunk = chunk
        self.instructions = []

    def predict(self, image, instruction, *, constrained):
        self.instructions.append((instruction, constrained))
        if isinstance(self._chunk, Exception):
            raise self._chunk
        return np.array(self._chunk, dtype=np.float64)


def _policy(chunk, **options):
    return VlaPolicy(
        "scripted", Scripted(chunk), STATISTICS, PolicyOptions(**options), {"checkpoint": "none"}
    )


STEP = [0.5, -0.5, 0.0, 0.1, 0.2, 0.3, 1.0]


def test_actions_are_scaled_and_come_as_steps(plain_frames):
    policy = _policy([STEP])
    assert isinstance(policy, FramePolicy)
    (step,) = policy.act(plain_frames[0], "pick up the mug")
    assert step.translation == pytest.approx((1.0, -1.0, 0.0))
    assert step.rotation == pytest.approx((0.2, 0.4, 0.6))
    assert step.gripper == 1.0
    check_adapter(policy)


@pytest.mark.parametrize(("execute", "n_steps"), [(None, 4), (2, 2), (9, 4)])
def test_so_many_steps_of_a_chunk_are_given_out(plain_frames, execute, n_steps):
    assert len(_policy([STEP] * 4, execute=execute).act(plain_frames[0], "x")) == n_steps


def test_an_ensemble_gives_out_one_step_and_forgets_at_reset(plain_frames):
    chunk = [STEP, [0.0] * 7]
    policy = _policy(chunk, ensemble="exp")
    first = policy.act(plain_frames[0], "x")
    second = policy.act(plain_frames[0], "x")
    assert len(first) == len(second) == 1
    # STEP of the second chunk with weight exp(0.8), nothing of the first with weight 1
    assert second[0].translation[0] == pytest.approx(1.0 * np.exp(0.8) / (1 + np.exp(0.8)))
    policy.reset()
    assert policy.act(plain_frames[0], "x") == first


def test_the_gripper_is_held_between_closed_and_open():
    steps = arm_deltas("x", np.array([[0.0] * 6 + [1.7], [0.0] * 6 + [-0.3]]))
    assert [step.gripper for step in steps] == [1.0, 0.0]
    assert all(isinstance(step, ArmDelta) for step in steps)


@pytest.mark.parametrize(
    ("chunk", "message"),
    [
        ([[*STEP[:3], float("nan"), *STEP[4:]]], "scripted gave an action that is not finite"),
        ([[float("inf"), *STEP[1:]]], "not finite"),
        (
            RuntimeError("CUDA out of memory. Tried to allocate"),
            "scripted fails on the request .*out of memory",
        ),
        (MemoryError("none left"), "scripted fails on the request"),
    ],
)
def test_what_is_no_action_is_refused(chunk, message, plain_frames):
    with pytest.raises(ModelError, match=message):
        _policy(chunk).act(plain_frames[0], "x")


@pytest.mark.parametrize("actions", [np.zeros((1, 6)), np.zeros((0, 7)), np.zeros(7)])
def test_actions_of_another_length_are_refused(actions):
    with pytest.raises(ModelError, match=r"gave actions of shape .*, not one or more of 7 numbers"):
        arm_deltas("x", actions)


def test_a_bad_chunk_does_not_stay_in_the_average(plain_frames):
    network = Scripted([[float("nan")] * 7] * 2)
    policy = VlaPolicy("scripted", network, STATISTICS, PolicyOptions(ensemble="exp"), {})
    with pytest.raises(ModelError):
        policy.act(plain_frames[0], "x")
    network._chunk = [STEP, STEP]
    assert policy.act(plain_frames[0], "x")[0].gripper == 1.0


def test_a_frame_that_is_not_there_is_a_fault_of_the_data(plain_frames):
    with pytest.raises(DataError):
        _policy([STEP]).act(FrameRef(plain_frames[0].path.with_name("none.png")), "x")


def test_the_identity_tells_how_chunks_are_used():
    identity = _policy([STEP], ensemble="exp", constrained=False).identity()
    assert identity["ensemble"] == "exp"
    assert identity["constrained"] is False
    assert identity["checkpoint"] == "none"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"ensemble": "mean"}, "ensemble=mean: give none or exp"),
        ({"execute": "0"}, "execute=0"),
        ({"ensemble": "exp", "execute": "4"}, "contradicts ensemble=exp"),
        ({"attn_implementation": "someone/kernel"}, "is code on the hub"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, message):
    with pytest.raises(UsageError, match=message):
        check_options("openvla-tiny", options)


def _chunk(*firsts):
    return np.array([[first] + [0.0] * 6 for first in firsts])


def _firsts(ensemble, *chunks):
    return [float(ensemble.step(chunk)[0, 0]) for chunk in chunks]


def test_what_several_chunks_say_of_a_step_is_averaged_the_newest_counting_most():
    averages = _firsts(
        ExponentialEnsemble(),
        _chunk(1, 10, 100),
        _chunk(2, 20, 200),
        _chunk(3, 30, 300),
        _chunk(4, 40, 400),
    )
    one, two = math.exp(0.8), math.exp(1.6)
    assert averages == pytest.approx(
        [
            1,
            (10 + one * 2) / (1 + one),
            (100 + one * 20 + two * 3) / (1 + one + two),
            (200 + one * 30 + two * 4)
            / (1 + one + two),  # the first chunk says nothing of the fourth step
        ]
    )


def test_an_episode_begins_without_the_last_one():
    ensemble = ExponentialEnsemble()
    _firsts(ensemble, _chunk(1, 10))
    ensemble.reset()
    assert _firsts(ensemble, _chunk(5, 50)) == [5]


def test_chunks_of_one_step_are_given_out_as_they_are():
    assert _firsts(ExponentialEnsemble(), _chunk(1), _chunk(2), _chunk(3)) == [1, 2, 3]
