"""OpenVLA's action tokens against numbers computed by hand."""

import numpy as np
import pytest

from model_adapters.policies.openvla.actions import ActionBins

BINS = ActionBins(vocabulary=32_000, n_bins=256)


def test_the_legal_ids_are_the_last_256_before_the_padding():
    assert (BINS.action_ids.start, BINS.action_ids.stop) == (31_744, 32_000)


@pytest.mark.parametrize(
    ("token", "number"),
    [
        (31_999, -254 / 255),  # the first bin: middle of -1 and -1 + 2/255
        (31_998, -252 / 255),
        (31_872, 0.0),  # the 128th of 255 centres
        (31_871, 2 / 255),
        (31_746, 252 / 255),
        (31_745, 254 / 255),  # the last bin
        (31_744, 254 / 255),  # a border more than bins: the lowest id means the last bin too
    ],
)
def test_tokens_mean_the_middles_of_their_bins(token, number):
    assert BINS.decode([token] * 7)[0] == pytest.approx([number] * 7, abs=1e-12)


def test_seven_tokens_make_one_action_in_their_order():
    tokens = [31_999, 31_745, 31_872, 31_999, 31_745, 31_872, 31_745]
    expected = np.array([-254, 254, 0, -254, 254, 0, 254]) / 255
    assert BINS.decode(tokens) == pytest.approx(expected[None])
