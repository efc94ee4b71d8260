"""Torch's choice of a kernel, and what a call takes for itself."""

import pytest
import torch

from model_adapters.hf.rehearsal.kernels import EFFICIENT, FLASH, MATH, attention_of

HALF = torch.bfloat16


def called(
    n_queries=64, n_keys=64, head=128, *, value_head=None, dtype=HALF, mask=False, is_causal=False
):
    """A call with 8 heads, 2 of which have keys."""
    query = torch.empty(1, 8, n_queries, head, dtype=dtype, device="meta")
    key = torch.empty(1, 2, n_keys, head, dtype=dtype, device="meta")
    value = torch.empty(1, 2, n_keys, value_head or head, dtype=dtype, device="meta")
    seen = torch.empty(1, 1, n_queries, n_keys, dtype=torch.bool, device="meta") if mask else None
    return attention_of(query, key, value, seen, is_causal, True)


@pytest.mark.parametrize(
    ("settings", "kernel"),
    [
        ({}, FLASH),
        ({"is_causal": True}, FLASH),
        ({"head": 80}, FLASH),
        ({"head": 256}, FLASH),
        ({"mask": True}, EFFICIENT),
        ({"head": 512}, EFFICIENT),
        ({"dtype": torch.float32}, EFFICIENT),
        ({"n_keys": 128, "is_causal": True}, EFFICIENT),
        ({"value_head": 64}, EFFICIENT),
        ({"head": 20, "mask": True}, MATH),
        ({"dtype": torch.float64}, MATH),
    ],
)
def test_the_kernel_is_the_first_that_takes_the_call(settings, kernel):
    call = called(**settings)
    assert (call.kernel, call.has_mask) == (kernel, bool(settings.get("mask")))


def test_a_mask_of_truth_values_becomes_one_of_numbers_in_rows_of_eight():
    aligned = called(100, 8000, mask=True).own_bytes
    assert aligned == 100 * 8000 * 2
    assert called(100, 8001, mask=True).own_bytes == 2 * 100 * 8001 * 2


def test_only_the_last_resort_has_all_scores_at_a_time():
    scores = 8 * 1000 * 4000 * 4
    assert called(1000, 4000, head=20, mask=True).own_bytes > 2 * scores
    assert called(1000, 4000, mask=True).own_bytes < scores
    assert called(1000, 4000).own_bytes < scores / 100
