"""De-normalisation of actions: from -1 to 1 to the metres and radians of a dataset's robot."""

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from infthor_eval.errors import ModelError, UsageError

ACTION_SIZE = 7  # x, y, z, roll, pitch, yaw, gripper

Actions = npt.NDArray[np.float64]  # (steps, 7)


class ActionStatistics(msgspec.Struct, frozen=True):
    """Percentiles of a dataset's actions, as checkpoints store them.

    Attributes:
        q01: first percentile of each of the seven numbers, in the dataset's units.
        q99: 99th percentile of each.
        mask: true for numbers that were scaled to -1..1 in training; the others (the gripper) are
            not scaled.
    """

    q01: list[float]
    q99: list[float]
    mask: list[bool] | None = None

    def unnormalise(self, actions: Actions) -> Actions:
        """Return actions, (steps, 7), in the dataset's units: metres and radians a step, for arms.

        Training mapped q01 and q99 to -1 and 1, so this is the inverse; values beyond are not
        clipped.
        """
        low, high = np.array(self.q01), np.array(self.q99)
        scaled = 0.5 * (actions + 1) * (high - low) + low
        return np.where(np.array(self.mask or [True] * ACTION_SIZE), scaled, actions)


def select_statistics(
    known: Mapping[str, Any], unnorm_key: str | None, pretrained: str
) -> tuple[str, ActionStatistics]:
    """Return the key and the statistics of one of the datasets that a checkpoint was trained on.

    Args:
        known: the checkpoint's statistics by dataset; "action" of each has those of the actions.
        unnorm_key: key of the dataset, or None if there is only one.
        pretrained: name of the checkpoint, for messages.
    """
    listed = ", ".join(sorted(known)) or "none"
    if unnorm_key is None and len(known) != 1:
        raise UsageError(
            f"{pretrained} was trained on several datasets; choose one with unnorm_key= of {listed}"
        )
    key = next(iter(known)) if unnorm_key is None else unnorm_key
    if key not in known:
        raise UsageError(f"unnorm_key={key} is not a dataset of {pretrained}; there are {listed}")
    try:
        statistics = msgspec.convert(known[key]["action"], ActionStatistics)
    except (msgspec.ValidationError, LookupError, TypeError) as error:
        raise ModelError(
            f"the statistics of {key} in {pretrained} are damaged ({error}); restore them"
        ) from error
    sizes = {
        len(values)
        for values in (statistics.q01, statistics.q99, statistics.mask)
        if values is not None
    }
    if sizes != {ACTION_SIZE}:
        raise ModelError(
            f"the actions of {key} in {pretrained} have {sorted(sizes)} numbers, not {ACTION_SIZE}"
        )
    return key, statistics
