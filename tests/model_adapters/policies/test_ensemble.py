"""Averages of overlapping chunks, by hand."""

import math

import numpy as np
import pytest

from model_adapters.policies.ensemble import ExponentialEnsemble


def _chunk(*firsts: float) -> np.ndarray:
    return np.array([[first] + [0.0] * 6 for first in firsts])


def _firsts(ensemble: ExponentialEnsemble, *chunks: np.ndarray) -> list[float]:
    return [float(ensemble.step(chunk)[0, 0]) for chunk in chunks]


def test_what_several_chunks_say_of_a_step_is_averaged_the_newest_counting_most() -> None:
    averages = _firsts(
        ExponentialEnsemble(),
        _chunk(1, 10, 100),
        _chunk(2, 20, 200),
        _chunk(3, 30, 300),
        _chunk(4, 40, 400),
    )
    one, two = math.exp(0.8), math.exp(1.6)
    assert averages == pytest.approx(
        [
            1,
            (10 + one * 2) / (1 + one),
            (100 + one * 20 + two * 3) / (1 + one + two),
            (200 + one * 30 + two * 4)
            / (1 + one + two),  # the first chunk says nothing of the fourth step
        ]
    )


def test_an_episode_begins_without_the_last_one() -> None:
    ensemble = ExponentialEnsemble()
    _firsts(ensemble, _chunk(1, 10))
    ensemble.reset()
    assert _firsts(ensemble, _chunk(5, 50)) == [5]


def test_chunks_of_one_step_are_given_out_as_they_are() -> None:
    assert _firsts(ExponentialEnsemble(), _chunk(1), _chunk(2), _chunk(3)) == [1, 2, 3]
