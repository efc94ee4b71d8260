"""Where patches lie, on scenes whose depth is known."""

import math
from types import SimpleNamespace

import pytest
import torch
from torch import nn

from model_adapters.policies.spatialvla.ego3d import Ego3DEmbedding, back_project, estimate_depth

INTRINSICS = torch.tensor([[10.0, 0, 14], [0, 20.0, 14], [0, 0, 1]])


def test_points_of_a_wall_lie_on_the_rays_through_the_middles_of_cells():
    depth = torch.full((1, 1, 28, 28), 2.0)
    points = back_project(depth, INTRINSICS, patch=14, resolution=2)
    assert points.shape == (1, 4, 12)
    # Middles of cells of 7 pixels: 3.5, 10.5, 17.5, 24.5, so that
    # x = 2 (u - 14) / 10, y = 2 (v - 14) / 20, z = 2.
    x, y = (
        [2 * (u - 14) / 10 for u in (3.5, 10.5, 17.5, 24.5)],
        [2 * (v - 14) / 20 for v in (3.5, 10.5, 17.5, 24.5)],
    )
    # Row by row within the patch.
    first = [x[0], y[0], 2, x[1], y[0], 2, x[0], y[1], 2, x[1], y[1], 2]
    second = [x[2], y[0], 2, x[3], y[0], 2, x[2], y[1], 2, x[3], y[1], 2]  # the patch to its right
    assert points[0, 0].tolist() == pytest.approx(first)
    assert points[0, 1].tolist() == pytest.approx(second)


def test_pixels_are_as_coarse_as_the_weights():
    unit = torch.eye(3)
    coarse = back_project(
        torch.ones(1, 1, 224, 224, dtype=torch.bfloat16), unit, patch=14, resolution=2
    )
    fine = back_project(torch.ones(1, 1, 224, 224), unit, patch=14, resolution=2)
    assert coarse.dtype == fine.dtype == torch.float32
    assert fine[0, -1, -3:].tolist() == [220.5, 220.5, 1.0]
    assert coarse[0, -1, -3:].tolist() == [220.0, 220.0, 1.0]
    assert coarse[0, 0, :3].tolist() == [3.5, 3.5, 1.0]


def test_depth_is_averaged_over_a_cell():
    depth = torch.zeros(1, 1, 28, 28)
    depth[..., :7, :7] = torch.arange(49.0).reshape(7, 7)
    assert back_project(depth, INTRINSICS, patch=14, resolution=2)[0, 0, 2] == pytest.approx(24.0)


class Seen(nn.Module):
    """Keeps what it is shown, and answers with a ramp from left to right."""

    def forward(self, pixel_values):
        self.shown = pixel_values
        size = pixel_values.shape[-1]
        return SimpleNamespace(predicted_depth=torch.linspace(0, 1, size).expand(1, size, size))


def test_depth_is_estimated_on_a_mirrored_border_that_is_cut_off_again():
    zoe = Seen()
    pixels = torch.zeros(1, 3, 224, 224)
    pixels[:, 0] = 1.0
    depth = estimate_depth(zoe, pixels, 384)
    assert zoe.shown.shape == (1, 3, 384, 384)
    assert zoe.shown[0, :, 200, 200].tolist() == pytest.approx([1.0, -1.0, -1.0], abs=1e-5)
    assert depth.shape == (1, 1, 224, 224)
    # 31 of 286 pixels on each side are border: with aligned corners, pixel 31 of 0..285 lies at
    # 31/285 of the ramp.
    assert depth[0, 0, 0, 0] == pytest.approx(31 / 285, abs=1e-3)
    assert depth[0, 0, 0, -1] == pytest.approx(254 / 285, abs=1e-3)


def test_coordinates_are_taken_around_two_metres_ahead_and_encoded_by_frequencies():
    module = Ego3DEmbedding(n_points=1, n_freqs=2, width=15)
    module.position_embedding_head = nn.Sequential(nn.Identity())
    module.register_parameter("dtype_of", nn.Parameter(torch.zeros(1)))
    (features,) = module(torch.tensor([[[1.0, -2.0, 3.0]]]))[0].tolist()
    near = (0.5, -1.0, 0.5)  # (x, y, z - 2) / 2
    expected = [
        value
        for a in near
        for value in (a, math.sin(a), math.sin(2 * a), math.cos(a), math.cos(2 * a))
    ]
    assert features == pytest.approx(expected, abs=1e-6)
