"""Averages over what overlapping chunks say of the same moment."""

from collections import deque

import numpy as np

from model_adapters.policies.statistics import Actions

__all__ = ["ExponentialEnsemble"]

_RATE = 0.8


class ExponentialEnsemble:
    """Gives one step a call: the average of what this chunk and the ones before say of it, the newest counting most.

    Of the predictions for the present step, oldest first, number i has the weight exp(0.8 i). That is what the
    published evaluations of SpatialVLA do (SimplerEnv's ActionEnsembler with a temperature of -0.8).
    """

    def __init__(self) -> None:
        self._chunks: deque[Actions] = deque()

    def reset(self) -> None:
        """Forget all chunks."""
        self._chunks.clear()

    def step(self, chunk: Actions) -> Actions:
        """The present step, (1, 7).

        Args:
            chunk: (steps, 7), beginning with the present step; each call is one step later.
        """
        self._chunks.append(chunk)
        while len(self._chunks) > len(chunk):
            self._chunks.popleft()
        age = range(len(self._chunks) - 1, -1, -1)
        predictions = np.stack([earlier[at] for at, earlier in zip(age, self._chunks, strict=True)])
        weights = np.exp(_RATE * np.arange(len(predictions)))
        return (weights[:, None] * predictions).sum(axis=0, keepdims=True) / weights.sum()
