"""Policies of one frame and an instruction as policies with episodes."""

from typing import Any

from model_adapters.protocols import (
    ArmDelta,
    ArmObservation,
    Capabilities,
    Episode,
    FramePolicy,
    Policy,
)


class FrameEpisodes:
    """A `FramePolicy` as a `Policy`: it is reset when an episode begins, and told no end."""

    def __init__(self, policy: FramePolicy) -> None:
        self._policy = policy
        self._instruction = ""

    @property
    def name(self) -> str:
        """The policy's."""
        return self._policy.name

    @property
    def capabilities(self) -> Capabilities:
        """The policy's."""
        return self._policy.capabilities

    def identity(self) -> dict[str, Any]:
        """Return the policy's."""
        return self._policy.identity()

    def begin(self, episode: Episode) -> None:
        """See `Policy`."""
        self._instruction = episode.instruction
        self._policy.reset()

    def act(self, observation: ArmObservation) -> tuple[ArmDelta, ...]:
        """See `Policy`."""
        return self._policy.act(observation.image, self._instruction)

    def end(self, *, success: bool | None) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Close the policy."""
        self._policy.close()


def with_episodes(policy: Policy | FramePolicy) -> Policy:
    """Return a policy of either kind as one with episodes."""
    return policy if isinstance(policy, Policy) else FrameEpisodes(policy)
