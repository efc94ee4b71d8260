"""A loaded network as a `Policy`: scaling, averaging and checking of its actions."""

from collections import deque
from typing import Any, ClassVar, Protocol

import numpy as np
import torch
from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.global_settings import torch_threads
from model_adapters.options.policies import ActionOptions, CheckpointPolicyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint, find_policy_checkpoint
from model_adapters.policies.preprocessing import crop_centre
from model_adapters.policies.statistics import ACTION_SIZE, Actions, ActionStatistics
from model_adapters.protocols import ArmDelta, Capabilities
from model_adapters.refusals import wrap_request_errors

_RATE = 0.8


class Network(Protocol):
    """A network that predicts actions from a frame."""

    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """Return a chunk of normalised actions, (steps, 7), each number between -1 and 1.

        Args:
            image: the frame, RGB.
            instruction: the suite's instruction; the network adds its prompt.
            constrained: decode among action tokens only.

        Raises:
            ModelError: the scores are not finite.
        """


def arm_deltas(name: str, actions: Actions) -> tuple[ArmDelta, ...]:
    """Return actions as steps of an arm, with the gripper clipped to 0 (closed) to 1 (open).

    Actions are (steps, 7): x, y, z, roll, pitch, yaw, gripper.
    """
    if actions.ndim != 2 or actions.shape[1] != ACTION_SIZE or not len(actions):
        raise ModelError(
            f"{name} gave actions of shape {list(actions.shape)}, not one or more of {ACTION_SIZE} "
            "numbers"
        )
    if not np.isfinite(actions).all():
        raise ModelError(f"{name} gave an action that is not finite: {actions.tolist()}")
    return tuple(
        ArmDelta((x, y, z), (roll, pitch, yaw), min(max(gripper, 0.0), 1.0))
        for x, y, z, roll, pitch, yaw, gripper in actions.tolist()
    )


class VlaPolicy:
    """A vision-language-action model with its network in this process, or in vLLM.

    Args:
        name: name in the registry.
        network: network that predicts normalised actions.
        statistics: statistics that scale the actions.
        options: decoding and use of the actions.
        identity: identity of checkpoint, dataset and machine, as JSON values.
        threads: torch threads of the network's computations; torch's default where None.
        crop: side in pixels to which the middle of a frame is scaled before the network gets it;
            the whole frame where None.
    """

    def __init__(
        self,
        name: str,
        network: Network,
        statistics: ActionStatistics,
        options: ActionOptions,
        identity: dict[str, Any],
        threads: int | None = None,
        crop: int | None = None,
    ) -> None:
        self.name = name
        self._network = network
        self._statistics = statistics
        self._options = options
        self._identity = identity
        self._threads = threads
        self._crop = crop
        self._ensemble = ExponentialEnsemble()

    @property
    def capabilities(self) -> Capabilities:
        """Deterministic, one request at a time."""
        return Capabilities(counts_tokens=False, token_ids=False)

    def identity(self) -> dict[str, Any]:
        """Return checkpoint, dataset of the statistics, precision, versions and use of chunks, as
        JSON values."""
        options = self._options
        cropped = {} if self._crop is None else {"center_crop": True}
        return {
            **self._identity,
            "adapter": self.name,
            "constrained": options.constrained,
            "ensemble": options.ensemble,
            "execute": options.execute,
            **cropped,
        }

    def reset(self) -> None:
        """Drop the chunks of the last episode."""
        self._ensemble.reset()

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """Return the next steps; see `Policy.act`."""
        with wrap_request_errors(self.name), torch_threads(self._threads):
            image = frame.load()
            if self._crop is not None:
                image = crop_centre(image, self._crop)
            chunk = self._network.predict(image, instruction, constrained=self._options.constrained)
            actions = self._statistics.unnormalise(chunk)
            # Refuses a bad chunk before it is averaged into later steps.
            arm_deltas(self.name, actions)
            steps = self._ensemble.step(actions) if self._options.ensemble == "exp" else actions
            return arm_deltas(self.name, steps[: self._options.execute])

    def close(self) -> None:
        """Free the weights."""
        del self._network
        if torch.cuda.is_available():
            torch.cuda.empty_cache()


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
    def build(
        cls,
        name: str,
        options: CheckpointPolicyOptions,
        seed: int,  # noqa: ARG003
    ) -> VlaPolicy:
        """Load a checkpoint; the seed is not used."""
        return cls.load(name, find_policy_checkpoint(options.pretrained, options.revision), options)


class ExponentialEnsemble:
    """Averages this and earlier chunks' predictions of a step; the newest has the most weight.

    The weight of prediction i, counted from the oldest, is exp(0.8 i), as in the published
    evaluations of SpatialVLA (SimplerEnv's ActionEnsembler with a temperature of -0.8).
    """

    def __init__(self) -> None:
        self._chunks: deque[Actions] = deque()

    def reset(self) -> None:
        """Drop all chunks."""
        self._chunks.clear()

    def step(self, chunk: Actions) -> Actions:
        """Return the current step, (1, 7).

        Args:
            chunk: new predictions, (steps, 7), beginning with the current step; each call is one
                step later.
        """
        self._chunks.append(chunk)
        while len(self._chunks) > len(chunk):
            self._chunks.popleft()
        age = range(len(self._chunks) - 1, -1, -1)
        predictions = np.stack([earlier[at] for at, earlier in zip(age, self._chunks, strict=True)])
        weights = np.exp(_RATE * np.arange(len(predictions)))
        return (weights[:, None] * predictions).sum(axis=0, keepdims=True) / weights.sum()
