"""Hashes of what a model reads: other pixels, another order or other tokens have others."""

import torch
from hypothesis import given
from hypothesis import strategies as st

from model_adapters.hf.prompting.hashing import (
    hash_context,
    hash_frame,
    hash_frames,
    split_frames,
)


def frame(seed, n=5000):
    return {"pixel_values": torch.rand(n, generator=torch.Generator().manual_seed(seed))}


@given(at=st.integers(0, 4999), change=st.sampled_from([1e-6, -1e-3, 0.5]))
def test_a_value_that_differs_makes_another_hash(at, change):
    other = frame(0)
    other["pixel_values"][at] += change
    same = bool((other["pixel_values"] == frame(0)["pixel_values"]).all())
    assert (hash_frame(other) == hash_frame(frame(0))) == same


def test_sizes_are_no_pixels_and_the_shape_does_not_matter():
    pixels = frame(1, 4096)["pixel_values"]
    grid = {"image_grid_thw": torch.tensor([[1, 2, 2]])}
    assert hash_frame({"pixel_values": pixels.reshape(4, 1024)} | grid) == hash_frame(
        frame(1, 4096)
    )


def test_order_counts_for_frames_and_tokens():
    one, two = (hash_frame(frame(seed)) for seed in (0, 1))
    assert len({hash_frames([one, two]), hash_frames([two, one]), hash_frames([one])}) == 3
    assert len({hash_context([1, 2]), hash_context([2, 1]), hash_context([12])}) == 3


def test_frames_of_a_processors_output_are_told_apart_where_that_is_clear():
    values = torch.rand(6, 1024)
    rows = [{"pixel_values": row} for row in values]
    assert [*map(hash_frame, split_frames({"pixel_values": values}, 6))] == [*map(hash_frame, rows)]
    grids = torch.tensor([[1, 1, 2], [1, 2, 2]])
    by_grid = {"pixel_values": values, "image_grid_thw": grids}
    assert [len(part["pixel_values"]) for part in split_frames(by_grid, 2)] == [2, 4]
    assert not [*split_frames({"pixel_values": values}, 5)]
    assert not [*split_frames(by_grid, 3)]
    assert not [*split_frames({}, 2)]
