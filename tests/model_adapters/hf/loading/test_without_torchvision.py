"""Image processors that exist for torchvision alone make the same pixels without it."""

import importlib.util
import os
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
import torch
import transformers
from PIL import Image
from transformers import AutoConfig
from transformers.models.auto.image_processing_auto import IMAGE_PROCESSOR_MAPPING_NAMES

from model_adapters.hf.loading.processors import (
    available_class,
    register_image_processor,
    torchvision_or_stand_in,
)

from ...conftest import PEERS

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("torchvision") is not None, reason="torchvision is installed"
)

# Families that have no image processor of PIL.
FAMILIES = ("cohere2_vision", "lfm2_vl", "llama4", "molmo2")
# Frames of the published data, small and large ones, and sides that differ.
SIZES = ((300, 300), (60, 60), (1000, 700), (97, 613))
# Runs in a process of its own, because the stand-ins for torchvision's compiled half must come
# before transformers.
WITH_TORCHVISION = """
import sys
import torch
library = torch.library.Library("torchvision", "DEF")
for name in ("nms", "qnms"):
    library.define(name + "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
import transformers
from PIL import Image
folder, *names = sys.argv[1:]
processors = {name: getattr(transformers, name)() for name in names}
images = [Image.open(f"{folder}/{number}.png") for number in range(4)]
torch.save(
    {
        name: [dict(processor(images=[image], return_tensors="pt")) for image in images]
        for name, processor in processors.items()
    },
    f"{folder}/pixels.pt",
)
"""


def _images(folder):
    draw = np.random.default_rng(0)
    images = []
    for number, (width, height) in enumerate(SIZES):
        image = Image.fromarray(draw.integers(0, 256, (height, width, 3), dtype=np.uint8))
        image.save(folder / f"{number}.png")
        images.append(image)
    return images


def _class_name(family):
    return str(IMAGE_PROCESSOR_MAPPING_NAMES[family]["torchvision"])


def test_pixels_are_those_of_torchvision(tmp_path):
    if not PEERS.is_dir():
        pytest.skip("torchvision is not set aside in test-peers (make test does it)")
    images = _images(tmp_path)
    names = list(map(_class_name, FAMILIES))
    subprocess.run(
        [sys.executable, "-c", WITH_TORCHVISION, tmp_path, *names],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONPATH": str(PEERS)},
    )
    expected = torch.load(tmp_path / "pixels.pt")
    for name in names:
        with torchvision_or_stand_in():
            processor = available_class(getattr(transformers, name))()
        for image, theirs in zip(images, expected[name], strict=True):
            ours = processor(images=[image], return_tensors="pt")
            assert set(ours) == set(theirs)
            for key, value in theirs.items():
                assert torch.equal(ours[key], value), f"{name}: {key} of {image.size}"


@pytest.mark.parametrize("family", FAMILIES)
def test_transformers_finds_what_is_registered_and_no_torchvision(family, tmp_path):
    from transformers import CONFIG_MAPPING, AutoImageProcessor

    if family not in CONFIG_MAPPING:  # Molmo 2 came with 5.20
        pytest.skip(f"transformers {transformers.__version__} has no {family}")
    config = AutoConfig.for_model(family)
    with torchvision_or_stand_in():
        register_image_processor(config)
    assert "torchvision" not in sys.modules
    assert importlib.util.find_spec("torchvision") is None
    (tmp_path / "preprocessor_config.json").write_text(
        f'{{"image_processor_type": "{_class_name(family)}Fast"}}'  # as the published ones
    )
    loaded = AutoImageProcessor.from_pretrained(tmp_path, backend="pil")
    assert type(loaded).__name__ == _class_name(family)


def test_what_torch_cannot_do_alone_is_named():
    with torchvision_or_stand_in():
        processor_class = available_class(transformers.Llama4ImageProcessor)
        processor = processor_class(resample=Image.Resampling.LANCZOS)
    with pytest.raises(NotImplementedError, match=r"resample=1 requires the torchvision library"):
        processor(images=[Image.new("RGB", (60, 60))], return_tensors="pt")


def test_a_family_with_an_image_processor_of_pil_keeps_it():
    from transformers import Gemma4Config

    with torchvision_or_stand_in():
        register_image_processor(Gemma4Config())
        module = import_module("transformers.models.auto.image_processing_auto")
    assert Gemma4Config not in module.IMAGE_PROCESSOR_MAPPING._extra_content
