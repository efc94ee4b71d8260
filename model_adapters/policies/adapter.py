"""Base of the adapters that load a policy's checkpoint."""

from typing import Any, ClassVar

from model_adapters.options.policies import CheckpointPolicyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint, find_policy_checkpoint
from model_adapters.policies.policy import VlaPolicy

__all__ = ["PolicyAdapter"]


class PolicyAdapter:
    """Base of the adapters of one family of policies.

    Attributes:
        Options: options of the family, with its default checkpoint.
    """

    Options: ClassVar[type]

    @staticmethod
    def load(name: str, checkpoint: PolicyCheckpoint, options: Any) -> VlaPolicy:
        """Load a checkpoint of the family from its folder."""
        raise NotImplementedError

    @classmethod
    def build(cls, name: str, options: CheckpointPolicyOptions, seed: int) -> VlaPolicy:  # noqa: ARG003
        """Load a checkpoint; the seed is not used.

        Raises:
            ModelError: the checkpoint cannot be loaded, or is of another family.
            UsageError: the unnorm_key, the device or the dtype is unknown.
            DataError: a file beside the weights is missing or damaged.
        """
        return cls.load(name, find_policy_checkpoint(options.pretrained, options.revision), options)
