"""The contract check of policies, on one that plays a script."""

import hashlib
import math

import pytest

from model_adapters import ArmDelta, Capabilities, ContractError, Policy, check_adapter

STEP = ArmDelta((0.0, 0.1, 0.0), (0.0, 0.0, 0.5), 1.0)


class Scripted:
    """Moves by what the frame's digest says, a little more with every call of an episode."""

    name = "scripted"
    capabilities = Capabilities()

    def __init__(self):
        self.n_calls = 0

    def identity(self):
        return {"policy": self.name}

    def reset(self):
        self.n_calls = 0

    def act(self, frame, instruction):
        self.n_calls += 1
        seed = hashlib.sha256(f"{frame.digest}{instruction}".encode()).digest()[0]
        return (ArmDelta((0.01 * self.n_calls, 0.0, 0.0), (0.0, 0.0, 0.0), seed / 255),)

    def close(self):
        pass


def _acting(*steps):
    return type("Acting", (Scripted,), {"act": lambda self, frame, instruction: steps})()


def test_a_good_policy_passes():
    assert isinstance(Scripted(), Policy)
    check_adapter(Scripted(), frame_size=(30, 20))
    check_adapter(_acting(STEP, STEP))


@pytest.mark.parametrize(
    ("step", "clause"),
    [
        ("left", "is not an ArmDelta"),
        (ArmDelta((0.0, 0.0), (0.0, 0.0, 0.0), 0.0), "is not three numbers"),
        (ArmDelta((0.0, math.nan, 0.0), (0.0, 0.0, 0.0), 0.0), "finite floats"),
        (ArmDelta((0, 0, 0), (0.0, 0.0, 0.0), 0.0), "finite floats"),
        (ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, math.inf), 0.0), "finite floats"),
        (ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.5), "the gripper is not between 0"),
    ],
)
def test_a_step_that_is_none_is_named(step, clause):
    with pytest.raises(ContractError, match=clause):
        check_adapter(_acting(STEP, step))


def test_no_step_is_named():
    with pytest.raises(ContractError, match="at least one ArmDelta"):
        check_adapter(_acting())


def test_an_episode_that_is_remembered_is_named_unless_chance_is_admitted():
    remembering = type("Remembering", (Scripted,), {"reset": lambda self: None})
    with pytest.raises(
        ContractError, match=r"after reset\(\) the same frames do not give the same actions"
    ):
        check_adapter(remembering())
    check_adapter(
        type("Random", (remembering,), {"capabilities": Capabilities(deterministic=False)})()
    )


def test_a_policy_without_reset_or_with_a_bad_identity_is_named():
    with pytest.raises(ContractError, match=r"Lost lacks a member of Policy: .*reset"):
        check_adapter(type("Lost", (), {"act": None})())
    with pytest.raises(ContractError, match="is a set, which JSON cannot hold"):
        check_adapter(type("Broken", (Scripted,), {"identity": lambda self: {"a": {1}}})())
