"""OpenVLA's action tokens: 256 bins between -1 and 1, counted down from the end of the vocabulary."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model_adapters.policies.statistics import Actions

__all__ = ["ActionBins"]


@dataclass(frozen=True)
class ActionBins:
    """How ids mean numbers.

    Attributes:
        vocabulary: ids of the language model without the padding at their end; 32000 in OpenVLA-7B.
        n_bins: how many of the last ids are actions; 256.
    """

    vocabulary: int
    n_bins: int

    @property
    def legal(self) -> range:
        """The ids that mean a number; 31744 to 31999 in OpenVLA-7B."""
        return range(self.vocabulary - self.n_bins, self.vocabulary)

    def decode(self, ids: Sequence[int]) -> Actions:
        """One action, (1, numbers), each between -1 and 1.

        256 borders make 255 centres: the two lowest ids mean the same number, as in the original.

        Args:
            ids: among `legal`.
        """
        borders = np.linspace(-1, 1, self.n_bins)
        centres = (borders[:-1] + borders[1:]) / 2
        index = np.clip(self.vocabulary - np.array(ids) - 1, 0, len(centres) - 1)
        return centres[index][None]
