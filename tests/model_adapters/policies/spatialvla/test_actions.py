"""SpatialVLA's action tokens against numbers computed by hand from the published borders."""

import math

import msgspec
import pytest

from infthor_eval.errors import ModelError
from model_adapters.policies.spatialvla.actions import ProcessorConfig, SpatialBins

from .published import BINS

BEGIN = 257_153
ROTATIONS = BEGIN + 16 * 32 * 8
GRIPPERS = ROTATIONS + 16**3
STILL = ROTATIONS, GRIPPERS


@pytest.fixture(scope="module")
def bins():
    return SpatialBins(BEGIN, **BINS)


def test_each_place_of_a_step_has_its_own_tokens(bins):
    assert [(place.start, place.stop) for place in bins.action_ids] == [
        (257_153, 261_249),
        (261_249, 265_345),
        (265_345, 265_347),
    ]


def test_the_gripper_is_closed_or_open(bins):
    ids = [BEGIN, ROTATIONS, GRIPPERS, BEGIN, ROTATIONS, GRIPPERS + 1]
    assert bins.decode(ids)[:, 6].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("axis", "number", "middle"),
    [
        ("theta", 0, 0.35335),  # (0 + 0.7067) / 2
        ("theta", 15, 2.985),  # (2.8284 + 3.1416) / 2
        ("phi", 0, -2.8507),  # (-3.1416 - 2.5598) / 2
        ("phi", 15, 0.0323),  # (-0.0294 + 0.094) / 2
        ("phi", 31, 2.8984),  # (2.6552 + 3.1416) / 2
        ("r", 0, 0.0984),  # (0 + 0.1968) / 2
        ("r", 6, 1.03105),  # (0.9228 + 1.1393) / 2
    ],
)
def test_the_outer_bins_of_each_spherical_axis(bins, axis, number, middle):
    place = {"theta": 0, "phi": 0, "r": 0, axis: number}
    token = BEGIN + (place["theta"] * 32 + place["phi"]) * 8 + place["r"]
    at = {"theta": 0.35335, "phi": -2.8507, "r": 0.0984, axis: middle}
    x, y, z = bins.decode([token, *STILL])[0, :3]
    sine, cosine = math.sin(at["theta"]), math.cos(at["theta"])
    expected = (
        at["r"] * sine * math.cos(at["phi"]),
        at["r"] * sine * math.sin(at["phi"]),
        at["r"] * cosine,
    )
    assert (x, y, z) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("axis", ["theta", "phi", "r"])
def test_every_bin_lies_between_its_borders(bins, axis):
    """Direction and length of each decoded translation fall into the very bin that the token
    counts."""
    step = {"theta": 32 * 8, "phi": 8, "r": 1}[axis]
    # Beside the first bins, whose lengths and angles are clear of the clip at one and of the poles.
    base = {"theta": 16 * 8 + 2, "phi": 5 * 32 * 8 + 2, "r": 5 * 32 * 8 + 12 * 8}[axis]
    borders = BINS[axis]
    for number in range(len(borders) - 1):
        x, y, z = bins.decode([BEGIN + base + number * step, *STILL])[0, :3].tolist()
        value = {
            "theta": math.atan2(math.hypot(x, y), z),
            "phi": math.atan2(y, x),
            "r": math.hypot(x, y, z),
        }[axis]
        clipped = axis == "r" and number == 7
        middle = (borders[number] + borders[number + 1]) / 2
        assert clipped or value == pytest.approx(middle, abs=1e-9)


def test_a_translation_beyond_one_is_clipped(bins):
    # theta in bin 0 (0.35335), the longest r: (1.1393 + 1.7321) / 2 = 1.4357; its z is 1.4357 cos
    # 0.35335 = 1.3470
    assert 1.4357 * math.cos(0.35335) > 1
    assert bins.decode([BEGIN + 7, *STILL])[0, 2] == 1.0


@pytest.mark.parametrize(
    ("token", "expected"),
    [
        # Middles: (-1 - 0.7121) / 2, (-1 - 0.6785) / 2 and (-1 - 0.691) / 2.
        (0, (-0.85605, -0.83925, -0.8455)),
        (1, (-0.85605, -0.83925, -0.6112)),  # yaw counts fastest: (-0.691 - 0.5314) / 2
        (16, (-0.85605, -0.59765, -0.8455)),  # then pitch: (-0.6785 - 0.5168) / 2
        (256, (-0.6343, -0.83925, -0.8455)),  # then roll: (-0.7121 - 0.5565) / 2
        (4095, (0.8381, 0.855, 0.849)),  # (0.6762 + 1) / 2, (0.71 + 1) / 2, (0.698 + 1) / 2
    ],
)
def test_rotations(bins, token, expected):
    assert bins.decode([BEGIN, ROTATIONS + token, GRIPPERS])[0, 3:6] == pytest.approx(
        expected, abs=1e-9
    )


def _config(**changes):
    counts = {name: len(borders) - 1 for name, borders in BINS.items()}
    content = {
        "action_chunk_size": 4,
        "intrinsic_config": {},
        "statistics": {},
        "action_config": {
            "use_spherical": True,
            "num_bins": {
                "gripper": 2,
                "translation": {f"{name}_bins": counts[name] for name in ("theta", "phi", "r")},
                "rotation": {f"{name}_bins": counts[name] for name in ("roll", "pitch", "yaw")},
            },
        },
        "bin_policy": {
            "translation": {f"{name}_bins": BINS[name] for name in ("theta", "phi", "r")},
            "rotation": {f"{name}_bins": BINS[name] for name in ("roll", "pitch", "yaw")},
        },
    }
    for at, value in changes.items():
        *path, last = at.split("__")
        place = content
        for name in path:
            place = place[name]
        place[last] = value
    return msgspec.convert(content, ProcessorConfig)


def test_bins_are_read_from_the_processor_s_config(bins):
    assert SpatialBins.of(_config(), BEGIN, 8194, "mine") == bins


@pytest.mark.parametrize(
    ("changes", "n_tokens", "message"),
    [
        ({"action_config__num_bins__translation__r_bins": 9}, 8194, r"do not fit \(r_bins\)"),
        ({"action_config__num_bins__gripper": 3}, 8194, "do not fit"),
        ({"action_config__use_spherical": False}, 8194, "no spherical bins"),
        ({}, 8190, "mine has 8190 action tokens and 8194 bins"),
    ],
)
def test_bins_that_do_not_fit_the_tokens_are_refused(changes, n_tokens, message):
    with pytest.raises(ModelError, match=message):
        SpatialBins.of(_config(**changes), BEGIN, n_tokens, "mine")
