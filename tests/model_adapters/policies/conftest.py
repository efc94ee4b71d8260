"""Tiny policies, their checkpoints, and frames to act on."""

import json
import shutil

import pytest
from PIL import Image
from safetensors.torch import load_file, save_file

from infthor_eval.formats.frames import FrameRef
from model_adapters.tiny.openvla import OpenVLATiny
from model_adapters.tiny.spatialvla import SpatialVLATiny

from ..asking import load_saved
from .servers import no_proxy  # noqa: F401 - a fixture

TWINS = {"openvla": OpenVLATiny.twin, "spatialvla": SpatialVLATiny.twin}
FAMILIES = tuple(TWINS)


@pytest.fixture(scope="session")
def policy_checkpoints(tmp_path_factory):
    """Folders of tiny checkpoints by family."""
    root = tmp_path_factory.mktemp("policies")
    for family, twin in TWINS.items():
        twin.save(root / family, seed=0)
    return {family: root / family for family in TWINS}


@pytest.fixture(scope="session")
def policies(policy_checkpoints):
    """The tiny checkpoints as the adapters of the published ones load them, by family."""
    loaded = {family: load_saved(family, at) for family, at in policy_checkpoints.items()}
    yield loaded
    for policy in loaded.values():
        policy.close()


@pytest.fixture
def altered(policy_checkpoints, tmp_path):
    """Makes a copy of a family's checkpoint and alters it; its folder."""

    def alter(family, edit):
        folder = tmp_path / "altered"
        shutil.copytree(policy_checkpoints[family], folder)
        edit(folder)
        return folder

    return alter


@pytest.fixture(scope="session")
def plain_frames(tmp_path_factory):
    """A black frame and a white one."""
    folder = tmp_path_factory.mktemp("plain")
    for colour in ("black", "white"):
        Image.new("RGB", (300, 300), colour).save(folder / f"{colour}.png")
    return FrameRef(folder / "black.png"), FrameRef(folder / "white.png")


def json_edit(name, change):
    """An edit of one JSON file of a checkpoint."""

    def edit(folder):
        content = json.loads((folder / name).read_text())
        change(content)
        (folder / name).write_text(json.dumps(content))

    return edit


def weights_edit(change):
    """An edit of a checkpoint's tensors."""

    def edit(folder):
        save_file(
            dict(change(load_file(folder / "model.safetensors"))), folder / "model.safetensors"
        )

    return edit
