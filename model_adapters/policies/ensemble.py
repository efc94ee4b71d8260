"""Temporal ensembling: averages of overlapping chunks' predictions for the same step."""

from collections import deque

import numpy as np

from model_adapters.policies.statistics import Actions

_RATE = 0.8


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
