"""Thresholds of the units, before and after the decoder learns to read."""

from types import SimpleNamespace

import torch

from recipes.nano.seeing.units import Role, Units
from recipes.nano.stages import lower_thresholds, raise_units

UNITS = Units(["Mug", "Sink"])
BEYOND = 3  # features of the layer that are no units


def tower():
    layer = torch.nn.Linear(2, len(UNITS) + BEYOND)
    torch.nn.init.zeros_(layer.bias)
    return SimpleNamespace(merger=SimpleNamespace(mlp=[layer]))


def bias_by_role(changed):
    bias = changed.merger.mlp[0].bias
    assert not bias[len(UNITS) :].any()
    return bias[: len(UNITS)].reshape(len(Role), len(UNITS.types)).tolist()


def test_all_units_are_on_earlier_for_the_decoder():
    changed = tower()
    lower_thresholds(changed, UNITS)
    assert bias_by_role(changed) == [[2.0, 2.0]] * len(Role)


def test_what_is_shown_counts_for_more_when_the_decoder_is_trained():
    changed = tower()
    raise_units(changed, UNITS)
    assert bias_by_role(changed) == [[1.0, 1.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
