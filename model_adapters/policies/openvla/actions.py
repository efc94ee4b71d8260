"""OpenVLA's action tokens: 256 bins from -1 to 1, counted down from the vocabulary's end."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model_adapters.policies.statistics import Actions


@dataclass(frozen=True)
class ActionBins:
    """Conversion of action ids to numbers.

    Attributes:
        vocabulary: number of ids of the language model without padding; 32000 in OpenVLA-7B.
        n_bins: number of action ids, the last of the vocabulary; 256.
    """

    vocabulary: int
    n_bins: int

    @property
    def action_ids(self) -> range:
        """Ids that encode a number; 31744 to 31999 in OpenVLA-7B."""
        return range(self.vocabulary - self.n_bins, self.vocabulary)

    def decode(self, ids: Sequence[int]) -> Actions:
        """Return one action, (1, numbers), each between -1 and 1.

        256 borders have 255 centres, so the two lowest ids encode the same number, as in the
        original.

        Args:
            ids: ids among `action_ids`.
        """
        borders = np.linspace(-1, 1, self.n_bins)
        centres = (borders[:-1] + borders[1:]) / 2
        index = np.clip(self.vocabulary - np.array(ids) - 1, 0, len(centres) - 1)
        return centres[index][None]
