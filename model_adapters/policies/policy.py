"""A loaded network as a `Policy`: scales, averages and checks what it writes."""

from typing import Any, Protocol

import numpy as np
import torch
from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.options.policies import ActionOptions
from model_adapters.policies.ensemble import ExponentialEnsemble
from model_adapters.policies.statistics import ACTION_SIZE, Actions, ActionStatistics
from model_adapters.protocols import ArmDelta, Capabilities
from model_adapters.refusals import wrap_request_errors

__all__ = ["Network", "VlaPolicy", "arm_deltas"]


class Network(Protocol):
    """What looks at a frame and writes actions."""

    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """A chunk of actions, (steps, 7), as the model writes them: between -1 and 1.

        Args:
            image: the frame, RGB.
            instruction: what is to be done, as the suite says it; the prompt around it is the network's.
            constrained: choose among tokens that mean an action.

        Raises:
            ModelError: it has no finite scores.
        """
        ...


def arm_deltas(name: str, actions: Actions) -> tuple[ArmDelta, ...]:
    """Actions as steps of an arm; the gripper is held to 0 (closed) to 1 (open).

    Args:
        name: of the policy, for the message.
        actions: (steps, 7): x, y, z, roll, pitch, yaw, gripper.

    Raises:
        ModelError: there are none, they have another length, or one is not finite.
    """
    if actions.ndim != 2 or actions.shape[1] != ACTION_SIZE or not len(actions):
        raise ModelError(
            f"{name} gave actions of shape {list(actions.shape)}, not one or more of {ACTION_SIZE} numbers"
        )
    if not np.isfinite(actions).all():
        raise ModelError(f"{name} gave an action that is no number: {actions.tolist()}")
    return tuple(
        ArmDelta((x, y, z), (roll, pitch, yaw), min(max(gripper, 0.0), 1.0))
        for x, y, z, roll, pitch, yaw, gripper in actions.tolist()
    )


class VlaPolicy:
    """A vision-language-action model whose weights are here.

    Args:
        name: the registry's name.
        network: writes the actions.
        statistics: scale them.
        options: how it is run.
        identity: of checkpoint, dataset and machine, as JSON values.
    """

    def __init__(
        self,
        name: str,
        network: Network,
        statistics: ActionStatistics,
        options: ActionOptions,
        identity: dict[str, Any],
    ) -> None:
        self.name = name
        self._network = network
        self._statistics = statistics
        self._options = options
        self._identity = identity
        self._ensemble = ExponentialEnsemble()

    @property
    def capabilities(self) -> Capabilities:
        """Deterministic, one request at a time."""
        return Capabilities(counts_tokens=False, token_ids=False)

    def identity(self) -> dict[str, Any]:
        """Checkpoint, dataset of the scale, precision, versions and how chunks are used, as JSON values."""
        options = self._options
        return self._identity | {
            "adapter": self.name,
            "constrained": options.constrained,
            "ensemble": options.ensemble,
            "execute": options.execute,
        }

    def reset(self) -> None:
        """Forget the chunks of the last episode."""
        self._ensemble.reset()

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """The next steps; see `Policy.act`."""
        with wrap_request_errors(self.name):
            image = frame.load()
            chunk = self._network.predict(image, instruction, constrained=self._options.constrained)
            actions = self._statistics.unnormalise(chunk)
            arm_deltas(self.name, actions)  # before a bad chunk is averaged into the steps to come
            chosen = self._ensemble.step(actions) if self._options.ensemble == "exp" else actions
            return arm_deltas(self.name, chosen[: self._options.execute])

    def close(self) -> None:
        """Free the weights."""
        del self._network
        if torch.cuda.is_available():
            torch.cuda.empty_cache()
