"""A policy beside a server that its own twin answers for."""

import math

import pytest
from PIL import Image

from infthor_eval.errors import DataError, UsageError
from model_adapters import ArmDelta
from model_adapters.policies.parity import (
    INSTRUCTIONS,
    compare_policies,
    frames_in_folder,
    load_policy,
    reference_policy,
    synthetic_frames,
)

from .servers import policy_answers, serve


class Still:
    """Gives the same steps, whatever it sees."""

    name = "still"

    def __init__(self, *steps):
        self.steps = steps

    def reset(self):
        pass

    def act(self, frame, instruction):
        return self.steps


STEP = ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
OTHER = ArmDelta((0.0, 0.25, 0.0), (0.0, 0.0, -0.5), 0.0)


@pytest.mark.parametrize("family", ["openvla", "spatialvla"])
def test_the_same_policy_behind_a_server_is_equal(family, policy_checkpoints, policies):
    settings = {"pretrained": str(policy_checkpoints[family]), "device": "cpu"}
    theirs = load_policy(family, settings)
    with synthetic_frames() as frames, serve(policy_answers(theirs)) as url:
        report = compare_policies(
            load_policy(family, settings), reference_policy(url, None), frames, INSTRUCTIONS, 1e-6
        )
        apart = compare_policies(
            policies["openvla"], reference_policy(url, None), frames[:1], INSTRUCTIONS[:1], 1e-6
        )
    assert report.equal
    assert [row.cells[1] for row in report.table().rows] == ["6"] * 3
    assert {row.cells[2] for row in report.table().rows} == {"1" if family == "openvla" else "4"}
    assert apart.equal == (family == "openvla")


def test_differences_are_told_by_kind(plain_frames):
    ours = Still(STEP)
    theirs = Still(OTHER)
    report = compare_policies(ours, theirs, plain_frames, ["pick up the mug"], 0.4)
    assert not report.equal
    assert report.table().rows[0].cells == ("pick up the mug", "2", "1", "0.25", "0.5", "1")
    assert ": different." in report.table().notes[0]
    assert compare_policies(ours, theirs, plain_frames, ["x"], 1.0).equal


def test_more_steps_than_the_other_gives_is_a_difference(plain_frames):
    ours = Still(STEP, STEP)
    theirs = Still(STEP)
    report = compare_policies(ours, theirs, plain_frames, ["x"], 1e9)
    assert not report.equal
    assert report.rows[0].largest == math.inf
    assert report.table().rows[0].cells[2] == "2 and 1"


def test_pictures_of_a_folder_are_taken_by_name(tmp_path):
    for name in ("b.png", "a.jpg"):
        Image.new("RGB", (8, 8)).save(tmp_path / name)
    (tmp_path / "notes.txt").write_text("x")
    assert [frame.path.name for frame in frames_in_folder(tmp_path)] == ["a.jpg", "b.png"]


def test_a_folder_without_pictures_is_refused(tmp_path):
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(DataError, match="has no pictures"):
            frames_in_folder(folder)


def test_misuse_is_refused():
    with pytest.raises(UsageError, match=r"--reference-url: url is not the address of a server"):
        reference_policy("host", None)
    with pytest.raises(
        UsageError, match=r"qwen2\.5-vl-tiny is not a policy; compare openvla or spatialvla"
    ):
        load_policy("qwen2.5-vl-tiny", {})
