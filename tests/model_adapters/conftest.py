"""Frames, tiny models and their checkpoints for the tests of adapters, and transformers' own way of
running these."""

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters import Video, load

from .checkpoints import FAMILIES, OTHERS, save, save_family
from .language_models import SETTINGS, save_language_model

PEERS = Path(sys.prefix) / "test-peers"  # torchvision's Python half, kept out of the environment

# Runs in a process of its own, because the stand-ins for torchvision's compiled half must come
# before transformers.
PLAINLY = """
import json, sys
import torch
library = torch.library.Library("torchvision", "DEF")
for name in ("nms", "qnms"):
    library.define(name + "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
from PIL import Image
from transformers import AutoImageProcessor, AutoModelForImageTextToText, AutoProcessor

def content(processor, model, parts):
    types = [type for type, value in parts]
    in_template_order = sorted(types, key=("image", "video", "text").index)
    if model.config.model_type == "llava_onevision" and types != in_template_order:
        # Its template writes images and videos before texts; in between, their token is written
        # into the text.
        tokens = {"image": processor.image_token, "video": processor.video_token}
        inline = "".join(tokens.get(type, value) for type, value in parts)
        return [{"type": "text", "text": inline}]
    return [
        {"type": type, "text": value} if type == "text" else {"type": type}
        for type, value in parts
    ]

def answer(processor, model, turns, new):
    messages = [
        {"role": role, "content": content(processor, model, parts)} for role, parts in turns
    ]
    text = processor.apply_chat_template(messages, add_generation_prompt=True)
    typed = [part for role, parts in turns for part in parts]
    images = [Image.open(value) for type, value in typed if type == "image"]
    videos = [value for type, value in typed if type == "video"]
    if videos:
        # No frame is sampled: the metadata say at which rate those that are given were.
        settings = {
            "videos": [[Image.open(path) for path in video["frames"]] for video in videos],
            "video_metadata": [
                {"fps": video["fps"], "total_num_frames": len(video["frames"])} for video in videos
            ],
        }
    else:
        settings = {}
    begin = processor.tokenizer.bos_token
    begun = begin is not None and text.startswith(begin)
    inputs = processor(
        text=[text],
        images=images or None,
        add_special_tokens=not begun,
        return_tensors="pt",
        **settings,
    )
    output = model.generate(**inputs, do_sample=False, max_new_tokens=new)
    ids = inputs["input_ids"][0].tolist()
    return ids, output[0, len(ids):].tolist()

work, answers = json.load(sys.stdin), {}
for folder, prompts in work["prompts"].items():
    processor = AutoProcessor.from_pretrained(folder)
    processor.image_processor = AutoImageProcessor.from_pretrained(folder, backend="pil")
    assert type(processor).__name__.endswith("Processor")
    model = AutoModelForImageTextToText.from_pretrained(folder)
    answers[folder] = [answer(processor, model, turns, work["new"]) for turns in prompts]
print(json.dumps(answers))
"""


@pytest.fixture(scope="session")
def make_frames(tmp_path_factory):
    """Writes frames of coloured noise, all different, and returns references to them."""

    def make(count, width=84, height=84, seed=0):
        folder = tmp_path_factory.mktemp("frames")
        draw = np.random.default_rng(seed)
        refs = []
        for index in range(count):
            coarse = draw.integers(0, 256, (4, 4, 3), dtype=np.uint8)
            path = folder / f"{index:09d}.png"
            Image.fromarray(coarse).resize((width, height)).save(path)
            refs.append(FrameRef(path))
        return refs

    return make


@pytest.fixture(scope="session")
def frames(make_frames):
    """Six small frames (9 tokens each in Qwen2.5-VL)."""
    return make_frames(6)


@pytest.fixture(scope="session")
def tiny():
    """A tiny Qwen2.5-VL that shares prefixes, with chunks small enough to need several."""
    model = load("qwen2.5-vl-tiny", {"chunk_tokens": "24"}, seed=0)
    yield model
    model.close()


@pytest.fixture(scope="session")
def plain():
    """The same model without sharing, encoding everything in one forward pass."""
    model = load("qwen2.5-vl-tiny", {"share_prefix": "false", "chunk_tokens": "1000000"}, seed=0)
    yield model
    model.close()


@pytest.fixture(scope="session")
def checkpoints(tmp_path_factory):
    """Folders of tiny checkpoints by family."""
    root = tmp_path_factory.mktemp("checkpoints")
    for name in (*FAMILIES, *OTHERS):
        save(name, root / name)
    return {name: root / name for name in (*FAMILIES, *OTHERS)}


@pytest.fixture(scope="session")
def language_models(tmp_path_factory):
    """A folder of tiny language models by their model type."""
    root = tmp_path_factory.mktemp("language_models")
    for model_type, settings in SETTINGS.items():
        save_language_model(root / model_type, model_type, **settings)
    return root


@pytest.fixture(scope="session")
def answer_plainly():
    """Has checkpoints answer by their own whole processor and `generate`, every prompt from its
    beginning.

    Takes conversations by checkpoint and the number of new tokens; gives token ids of prompt and
    reply, end token included.
    """

    def answer(prompts, new):
        if not PEERS.is_dir():
            pytest.skip("torchvision is not set aside in test-peers (make test does it)")
        prompts_as_json = {
            str(folder): [_as_json(turns) for turns in listed] for folder, listed in prompts.items()
        }
        run = subprocess.run(
            [sys.executable, "-c", PLAINLY],
            input=json.dumps({"new": new, "prompts": prompts_as_json}),
            check=True,
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONPATH": str(PEERS)},
        )
        answers = json.loads(run.stdout.splitlines()[-1])
        return {folder: answers[str(folder)] for folder in prompts}

    return answer


def _as_json(turns):
    return [(turn.role, [_part_as_json(part) for part in turn.parts]) for turn in turns]


def _part_as_json(part):
    if isinstance(part, Video):
        return "video", {"frames": [str(frame.path) for frame in part.frames], "fps": part.fps}
    return ("text", part) if isinstance(part, str) else ("image", str(part.path))


@pytest.fixture(scope="session")
def tiny_family(tmp_path_factory):
    """Returns the folder of a tiny checkpoint of a family of `benchmarks/families.py`."""

    @cache
    def make(family):
        folder = tmp_path_factory.mktemp(family)
        save_family(family, folder)
        return folder

    return make
