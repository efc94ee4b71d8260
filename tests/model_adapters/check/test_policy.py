"""The contract check of policies, on one that plays a script."""

import hashlib
import math
from dataclasses import replace

import pytest

from model_adapters import ArmDelta, Capabilities, ContractError, FramePolicy, check_adapter

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
    assert isinstance(Scripted(), FramePolicy)
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
        ContractError, match="the same episode again does not have the same actions"
    ):
        check_adapter(remembering())
    check_adapter(
        type("Random", (remembering,), {"capabilities": Capabilities(deterministic=False)})()
    )


class WithEpisodes:
    """Moves by the frame, the instruction and the steps of the episode."""

    name = "with-episodes"
    capabilities = Capabilities()

    def identity(self):
        return {}

    def begin(self, episode):
        self.episode = episode

    def act(self, seen):
        text = f"{seen.image.digest}{self.episode.instruction}{seen.step}"
        ahead = hashlib.sha256(text.encode()).digest()[0] / 255
        return (ArmDelta((ahead, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),)

    def end(self, *, success):
        self.episode = None

    def close(self):
        pass


def test_what_is_left_of_another_episode_is_named():
    check_adapter(WithEpisodes())

    class Leaking(WithEpisodes):
        """Acts on the instruction of the last other episode: the same one again tells nothing."""

        told = None, None

        def begin(self, episode):
            if episode.instruction != self.told[1]:
                self.told = self.told[1], episode.instruction
            super().begin(replace(episode, instruction=f"{episode.instruction}{self.told[0]}"))

    with pytest.raises(ContractError, match="something of the other is left when it begins"):
        check_adapter(Leaking())
    with pytest.raises(ContractError, match=r"lacks a member of Policy: .*end"):
        check_adapter(type("Endless", (), {"begin": None, "act": None})())


def test_a_policy_without_reset_or_with_a_bad_identity_is_named():
    with pytest.raises(ContractError, match=r"Lost lacks a member of FramePolicy: .*reset"):
        check_adapter(type("Lost", (), {"act": None})())
    with pytest.raises(ContractError, match="is a set, which JSON cannot hold"):
        check_adapter(type("Broken", (Scripted,), {"identity": lambda self: {"a": {1}}})())
