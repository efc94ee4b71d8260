"""Intrinsics against numbers computed by hand."""

import math

import pytest

from infthor_eval.errors import ModelError
from model_adapters.options.policies import parse_field_of_view
from model_adapters.policies.spatialvla.actions import CameraIntrinsics
from model_adapters.policies.spatialvla.camera import published_intrinsics, thor_intrinsics

DEFAULT = CameraIntrinsics(640, 480, [[623.588, 0, 319.501], [0, 623.588, 239.545], [0, 0, 1]])
OTHER = CameraIntrinsics(224, 224, [[100, 0, 112], [0, 100, 112], [0, 0, 1]])


def test_the_published_camera_is_squashed_with_the_frame():
    intrinsics = published_intrinsics({"default": DEFAULT}, "bridge_orig/1.0.0", 224, "mine")
    # 623.588 * 224/640, 319.501 * 224/640; 623.588 * 224/480, 239.545 * 224/480
    rows = [[218.2558, 0, 111.82535], [0, 291.007733, 111.787667], [0, 0, 1]]
    assert intrinsics.tolist() == [pytest.approx(row) for row in rows]


def test_a_dataset_s_own_camera_comes_before_the_default():
    cameras = {"default": DEFAULT, "mine": OTHER}
    assert published_intrinsics(cameras, "mine", 224, "x")[0, 0] == 100
    assert published_intrinsics(cameras, "yours", 224, "x")[0, 0] == pytest.approx(218.2558)


def test_thor_s_camera_of_a_square_frame():
    # 90 degrees: f is half the height. At 224 pixels: 112.
    rows = [[112, 0, 112], [0, 112, 112], [0, 0, 1]]
    assert thor_intrinsics(90, (300, 300), 224).tolist() == [pytest.approx(row) for row in rows]


def test_the_field_of_view_is_vertical():
    # f = 100 / tan 30 = 173.205 pixels of a frame of 400 x 200; squashed to 224: 96.9948 across,
    # 193.9897 down.
    intrinsics = thor_intrinsics(60, (400, 200), 224)
    focal = 100 / math.tan(math.pi / 6)
    assert [intrinsics[0, 0], intrinsics[1, 1]] == pytest.approx(
        [focal * 224 / 400, focal * 224 / 200]
    )
    assert [intrinsics[0, 2], intrinsics[1, 2]] == [112, 112]


def test_the_option_is_read():
    assert parse_field_of_view("default") is None
    assert parse_field_of_view("thor:59.7") == 59.7


@pytest.mark.parametrize(
    "text", ["thor", "thor:", "thor:0", "thor:180", "thor:nan", "unity:90", "90", ""]
)
def test_another_form_is_refused(text):
    with pytest.raises(ValueError, match="is not default or thor:DEGREES"):
        parse_field_of_view(text)


@pytest.mark.parametrize(
    "cameras",
    [
        {},
        {"default": CameraIntrinsics(0, 480, DEFAULT.intrinsic)},
        {"default": CameraIntrinsics(9, 9, [[1]])},
    ],
)
def test_a_checkpoint_without_a_camera_is_refused(cameras):
    with pytest.raises(
        ModelError, match=r"mine has no intrinsics for bridge and no default; give intrinsics=thor:"
    ):
        published_intrinsics(cameras, "bridge", 224, "mine")
