"""Image processors give the bits of transformers' own ones, whatever they are."""

import json
from typing import Any, cast

import numpy as np
import pytest
import torch
import transformers
from PIL import Image

from infthor_eval.errors import ModelError, UsageError
from model_adapters import check_options
from model_adapters.hf.loading.image_processors import load_image_processor, splitting_setting
from model_adapters.options.checkpoints import FrameScaling
from model_adapters.options.families import HfVlmOptions

_SMALL = {"height": 48, "width": 48}
_PROCESSORS = {
    "Qwen2VLImageProcessor": {"size": {"shortest_edge": 3136, "longest_edge": 20000}},
    "LlavaOnevisionImageProcessor": {
        "size": _SMALL,
        "image_grid_pinpoints": [[48, 48], [48, 96], [96, 48]],
    },
    "LlavaNextImageProcessor": {
        "size": {"shortest_edge": 48},
        "crop_size": _SMALL,
        "image_grid_pinpoints": [[48, 96], [96, 48]],
    },
    "SmolVLMImageProcessor": {
        "size": {"longest_edge": 128},
        "max_image_size": {"longest_edge": 64},
    },
    "Idefics3ImageProcessor": {
        "size": {"longest_edge": 128},
        "max_image_size": {"longest_edge": 64},
    },
    "DeepseekVLHybridImageProcessor": {
        "size": _SMALL,
        "high_res_size": {"height": 96, "width": 96},
    },
    "PixtralImageProcessor": {
        "size": {"longest_edge": 64},
        "patch_size": {"height": 16, "width": 16},
    },
    "Gemma3ImageProcessor": {"size": _SMALL},
    "GotOcr2ImageProcessor": {"size": _SMALL, "crop_to_patches": True},
    "CLIPImageProcessor": {"size": {"shortest_edge": 40}, "crop_size": {"height": 40, "width": 40}},
    "JanusImageProcessor": {"size": _SMALL},
}


def _folder(place, name, **settings):
    place.mkdir(exist_ok=True)
    written = {"image_processor_type": name, **_PROCESSORS[name], **settings}
    (place / "preprocessor_config.json").write_text(json.dumps(written))
    return place


def _own(folder):
    return cast(Any, transformers).AutoImageProcessor.from_pretrained(folder, backend="pil")


def _image(width, height):
    noise = np.random.default_rng(width).integers(0, 256, (height, width, 3), np.uint8)
    return Image.fromarray(noise)


@pytest.mark.parametrize("name", _PROCESSORS)
def test_pixels_are_those_of_transformers(name, tmp_path):
    folder = _folder(tmp_path / "model", name)
    own, quick = _own(folder), load_image_processor(folder)
    for image in (_image(75, 75), _image(110, 50), _image(75, 75)):
        theirs = own(images=[image], return_tensors="pt")
        ours = quick(images=[image], return_tensors="pt")
        assert set(ours) == set(theirs)
        for key, value in theirs.items():
            assert torch.equal(torch.as_tensor(ours[key]), torch.as_tensor(value)), key


@pytest.mark.parametrize("name", _PROCESSORS)
def test_settings_are_those_of_transformers(name, tmp_path):
    folder = _folder(tmp_path / "model", name)
    own, quick = _own(folder), load_image_processor(folder)
    quick(images=[_image(75, 75)], return_tensors="pt")
    assert quick.to_json_string() == own.to_json_string()
    own.save_pretrained(tmp_path / "own")
    quick.save_pretrained(tmp_path / "quick")
    written = [(tmp_path / of / "preprocessor_config.json").read_text() for of in ("own", "quick")]
    assert written[0] == written[1]


@pytest.mark.parametrize(
    "name", ["Qwen2VLImageProcessor", "DeepseekVLHybridImageProcessor", "SmolVLMImageProcessor"]
)
def test_pillow_resizes_nothing_once_a_size_is_known(name, tmp_path, monkeypatch):
    quick = load_image_processor(_folder(tmp_path / "model", name))
    quick(images=[_image(75, 75)], return_tensors="pt")
    monkeypatch.setattr(Image.Image, "resize", None)
    quick(images=[_image(75, 75)], return_tensors="pt")
    with pytest.raises(TypeError):
        quick(images=[_image(76, 75)], return_tensors="pt")


def test_other_settings_than_the_checkpoints_are_used(tmp_path):
    quick = load_image_processor(
        _folder(tmp_path / "model", "Qwen2VLImageProcessor"), max_pixels=5000
    )
    assert dict(quick.size)["longest_edge"] == 5000


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("SmolVLMImageProcessor", "do_image_splitting"),
        ("GotOcr2ImageProcessor", "crop_to_patches"),
        ("Gemma3ImageProcessor", "do_pan_and_scan"),
    ],
)
@pytest.mark.parametrize("splitting", [True, False])
def test_frames_are_split_as_the_option_says(name, setting, splitting, tmp_path):
    folder = _folder(tmp_path / "model", name)
    quick = load_image_processor(folder, FrameScaling(image_splitting=splitting))
    assert splitting_setting(quick) == setting
    assert json.loads(quick.to_json_string())[setting] is splitting


def test_splitting_is_refused_where_there_is_none(tmp_path):
    folder = _folder(tmp_path / "model", "CLIPImageProcessor")
    with pytest.raises(ModelError, match="cannot split frames; leave image_splitting out"):
        load_image_processor(folder, HfVlmOptions(pretrained="x", image_splitting=False))


def test_torchvision_is_named_where_it_is_missing(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(ValueError, match="pip install torchvision"):
        FrameScaling(image_backend="torchvision")
    with pytest.raises(UsageError, match="image_backend=cv2: give pil or torchvision"):
        check_options("hf-vlm", {"image_backend": "cv2"})
