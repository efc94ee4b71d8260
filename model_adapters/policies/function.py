"""A function of a user's own file as a policy: `def act(image, instruction)`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from model_adapters.policies.policy import arm_deltas
from model_adapters.protocols import ArmDelta, Capabilities


@dataclass(frozen=True, eq=False)
class FunctionPolicy:
    """A function that returns seven numbers, or several rows of them, for each view.

    Attributes:
        name: name of the policy.
        call: the function.
        options: values of its further parameters.
    """

    name: str
    call: Callable[..., Any]
    options: dict[str, Any]

    capabilities = Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def identity(self) -> dict[str, Any]:
        """Return the options; the file's content is known by its digest."""
        return dict(self.options)

    def reset(self) -> None:
        """Do nothing: a function has no episodes."""

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """Return the next steps; see `Policy.act`."""
        steps = self.call(frame.load(), instruction, **self.options)
        problem = f"{self.name} returned {steps!r:.60}"
        hint = (
            "return seven numbers: x, y, z in metres, roll, pitch, yaw in radians, gripper 0 to 1"
        )
        broken = (TypeError, ValueError, OverflowError)
        with wrap_errors(problem, hint, catch=broken, raise_as=ModelError):
            numbers = np.asarray(steps, dtype=np.float64)
        return arm_deltas(self.name, numbers[None] if numbers.ndim == 1 else numbers)

    def close(self) -> None:
        """Do nothing: what the function keeps ends with the process."""
