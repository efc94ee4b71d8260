"""From actions between -1 and 1, as a model writes them, to metres and radians, as a dataset's robot moved."""

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from infthor_eval.errors import ModelError, UsageError

__all__ = ["ACTION_SIZE", "ActionStatistics", "Actions", "statistics_of"]

ACTION_SIZE = 7  # x, y, z, roll, pitch, yaw, gripper

Actions = npt.NDArray[np.float64]  # (steps, 7)


class ActionStatistics(msgspec.Struct, frozen=True):
    """What the actions of a dataset lie between, as a checkpoint has it.

    Attributes:
        q01: the first percentile of each of the seven numbers, in the dataset's units.
        q99: the 99th.
        mask: which of them were scaled to -1..1; the others pass through as they are (the gripper).
    """

    q01: list[float]
    q99: list[float]
    mask: list[bool] | None = None

    def unnormalise(self, actions: Actions) -> Actions:
        """Actions, (steps, 7), in the dataset's units: metres and radians a step in those of robot arms."""
        low, high = np.array(self.q01), np.array(self.q99)
        scaled = 0.5 * (actions + 1) * (high - low) + low
        return np.where(np.array(self.mask or [True] * ACTION_SIZE), scaled, actions)


def statistics_of(known: Mapping[str, Any], unnorm_key: str | None, pretrained: str) -> tuple[str, ActionStatistics]:
    """The statistics of one of the datasets that a checkpoint was trained on.

    Args:
        known: the checkpoint's, by dataset, with the statistics of actions as "action" of each.
        unnorm_key: the dataset; None where there is only one.
        pretrained: the checkpoint, for messages.

    Returns:
        The dataset's key, and its statistics.

    Raises:
        UsageError: no such dataset, or none was chosen of several; the message lists them.
        ModelError: the statistics are not those of actions of seven numbers.
    """
    listed = ", ".join(sorted(known)) or "none"
    if unnorm_key is None and len(known) != 1:
        raise UsageError(f"{pretrained} was trained on several datasets; choose one by unnorm_key= of {listed}")
    key = next(iter(known)) if unnorm_key is None else unnorm_key
    if key not in known:
        raise UsageError(f"unnorm_key={key} is no dataset of {pretrained}; there are {listed}")
    try:
        found = msgspec.convert(known[key]["action"], ActionStatistics)
    except (msgspec.ValidationError, LookupError, TypeError) as error:
        raise ModelError(f"the statistics of {key} in {pretrained} are damaged ({error}); restore them") from error
    sizes = {len(values) for values in (found.q01, found.q99, found.mask) if values is not None}
    if sizes != {ACTION_SIZE}:
        raise ModelError(f"the actions of {key} in {pretrained} have {sorted(sizes)} numbers, not {ACTION_SIZE}")
    return key, found
