"""Checks of policies."""

import math
from collections.abc import Callable
from functools import partial

from infthor_eval.formats.frames import FrameRef
from model_adapters.check.clauses import check_identity, check_members, require
from model_adapters.protocols import ArmDelta, Policy

_INSTRUCTION = "pick up the mug"


def policy_checks(
    policy: Policy, black: FrameRef, white: FrameRef
) -> dict[str, Callable[[], None]]:
    """Return all checks of a policy by name; each raises `ContractError` for a broken clause."""
    return {
        "members": partial(check_members, policy),
        "identity": partial(check_identity, policy),
        "episodes": partial(_check_episodes, policy, (black, white)),
    }


def _check_episodes(policy: Policy, frames: tuple[FrameRef, ...]) -> None:
    episodes = [_run_episode(policy, frames) for _ in range(2)]
    alike = episodes[0] == episodes[1] or not policy.capabilities.deterministic
    require(alike, "after reset() the same frames do not give the same actions")


def _run_episode(policy: Policy, frames: tuple[FrameRef, ...]) -> list[tuple[ArmDelta, ...]]:
    policy.reset()
    chunks = [policy.act(frame, _INSTRUCTION) for frame in frames]
    for chunk in chunks:
        _check_chunk(chunk)
    return chunks


def _check_chunk(chunk: tuple[ArmDelta, ...]) -> None:
    require(
        isinstance(chunk, tuple) and len(chunk) > 0,
        "act() does not return a tuple of at least one ArmDelta",
    )
    for step in chunk:
        require(isinstance(step, ArmDelta), "a step of act() is not an ArmDelta")
        require(
            len(step.translation) == len(step.rotation) == 3,
            "a translation or rotation is not three numbers",
        )
        numbers = (*step.translation, *step.rotation, step.gripper)
        finite = all(isinstance(number, float) and math.isfinite(number) for number in numbers)
        require(finite, f"a step of act() is not made of finite floats: {step}")
        require(
            0 <= step.gripper <= 1,
            f"the gripper is not between 0 (closed) and 1 (open): {step.gripper}",
        )
