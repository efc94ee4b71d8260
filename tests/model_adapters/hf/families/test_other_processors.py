"""Processors and models that do things their own way: which token of theirs stands for a frame,
what they write around it, and whether their `generate` obeys."""

import itertools
import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import torch
from PIL import Image
from transformers import (
    Cohere2VisionProcessor,
)
from transformers.models.got_ocr2.image_processing_pil_got_ocr2 import GotOcr2ImageProcessorPil

import model_adapters
from infthor_eval.errors import ModelError
from model_adapters.hf.uncached import expand_image_tokens, image_token
from model_adapters.tiny.tokenizer import train_tokenizer

from ...asking import ask, load_saved, talk_of, up_to, user
from ...checkpoints import save_llava
from ...conftest import PEERS

# Runs in a process of its own, because the stand-ins for torchvision's compiled half must come
# before transformers.
COUNTS = """
import json
import torch
library = torch.library.Library("torchvision", "DEF")
for name in ("nms", "qnms"):
    library.define(name + "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
from PIL import Image
from transformers import (
    Gemma4AudioFeatureExtractor,
    Gemma4Processor,
    Gemma4VideoProcessor,
    Molmo2ImageProcessor,
    Molmo2Processor,
    Molmo2VideoProcessor,
)
from transformers.models.gemma4.image_processing_pil_gemma4 import Gemma4ImageProcessorPil
from model_adapters.hf.uncached import image_token, n_image_tokens
from model_adapters.tiny.tokenizer import train_tokenizer

def tokenizer(special, **named):
    ends = {"begin": "<s>", "end": "</s>", "pad": "</s>"}
    return train_tokenizer(("<s>", "</s>", *special), **ends, named=named)

names = {"image_token": "<|image|>", "boi_token": "<|image>", "eoi_token": "<image|>"}
names |= {"audio_token": "<|audio|>", "boa_token": "<|audio>", "eoa_token": "<audio|>"}
gemma4 = Gemma4Processor(
    Gemma4AudioFeatureExtractor(),
    Gemma4ImageProcessorPil(),
    tokenizer(tuple(names.values()), **names),
    Gemma4VideoProcessor(),
)
marks = "im_patch im_col im_start low_res_im_start frame_start im_end frame_end im_low".split()
names = {"image_token": "<|image|>", "video_token": "<|video|>"}
special = tokenizer((*names.values(), *(f"<{mark}>" for mark in marks)), **names)
molmo2 = Molmo2Processor(Molmo2ImageProcessor(), Molmo2VideoProcessor(), special)
image = Image.new("RGB", (60, 60))
counts = [(image_token(each), n_image_tokens(each, image)) for each in (gemma4, molmo2)]
print(json.dumps(counts))
"""
SIZE = {"height": 56, "width": 56}


_load = partial(load_saved, "hf-vlm")


SLOTS = {"idefics2": 4 + 1, "mllama": 1, "paligemma": 16}  # and a marker between two frames


@pytest.mark.parametrize(("family", "slots"), SLOTS.items())
def test_a_frame_has_the_tokens_that_one_more_takes(family, slots, tiny_family, frames):
    model = _load(tiny_family(family), share_prefix=False)
    assert model.tokens_per_frame(frames[0]) == slots
    counts = [talk_of(model, user(*frames[:n], "\nWhat is it?")).n_tokens for n in (1, 2, 3)]
    assert {later - earlier for earlier, later in itertools.pairwise(counts)} == {slots}


@pytest.mark.parametrize("family", SLOTS)
def test_an_architecture_that_would_be_run_wrongly_is_refused(family, tiny_family):
    with pytest.raises(ModelError, match=r"with shared prefixes.*; use share_prefix=false"):
        _load(tiny_family(family))


def test_a_generate_that_chooses_its_own_tokens_is_refused(tiny_family):
    with pytest.raises(
        ModelError, match=r"^JanusForCond.*generate returns other tokens .* use share_prefix=true$"
    ):
        _load(tiny_family("janus"), share_prefix=False)


def test_janus_replies_with_shared_prefixes(tiny_family, frames):
    model = _load(tiny_family("janus"))
    assert ask(model, frames[0], "\nWhat is it?").n_reply_tokens > 0
    assert model.tokens_per_frame(frames[0]) == 16 + 2


def test_a_processor_expands_its_image_token_and_not_the_marker_of_its_begin():
    names = {"image_token": "<image>", "boi_token": "<boi>", "eoi_token": "<eoi>"}
    special = ("<s>", "</s>", *names.values(), "<line>")
    named = {**names, "img_line_break_token": "<line>"}
    tokenizer = train_tokenizer(special, begin="<s>", end="</s>", pad="</s>", named=named)
    # Pixels as its own processor makes them, which needs torchvision.
    images = GotOcr2ImageProcessorPil(size=SIZE, crop_to_patches=False)
    images.patch_size = 3
    cohere = Cohere2VisionProcessor(images, tokenizer)
    assert image_token(cohere) == "<image>"
    ids = expand_image_tokens(cohere, [Image.new("RGB", (60, 60))])["input_ids"]
    assert ids.shape[1] == 1 + 3 * 3 + 1 + 1


def test_a_model_that_only_fails_with_shared_prefixes_is_said_to_run_without(tmp_path, frames):
    torch.manual_seed(0)
    # Layers that attend and keep a state, too.
    sizes = {"mamba_d_ssm": 64, "mamba_n_heads": 4, "mamba_d_head": 16, "mamba_d_state": 8}
    save_llava(tmp_path, model_type="falcon_h1", mamba_n_groups=1, mamba_chunk_size=16, **sizes)
    with pytest.raises(
        ModelError, match=r"llava cannot be run with shared .* \(.+\); use share_prefix=false$"
    ):
        _load(tmp_path)
    talk = talk_of(_load(tmp_path, share_prefix=False), user(frames[0], "\nWhat is it?"))
    assert talk.reply(up_to(2)).n_context_tokens == talk.n_tokens


def test_processors_that_need_torchvision_count_what_one_more_frame_takes():
    if not PEERS.is_dir():
        pytest.skip("torchvision is not set aside in test-peers (make test does it)")
    root = Path(model_adapters.__file__).parents[1]
    run = subprocess.run(
        [sys.executable, "-c", COUNTS],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": f"{PEERS}{os.pathsep}{root}"},
    )
    # Gemma 4: 256 slots and 2 markers. Molmo 2: 2 views of 14 rows, each row with its end, between
    # markers, without the token that begins the prompt.
    assert json.loads(run.stdout.splitlines()[-1]) == [
        ["<|image|>", 256 + 2],
        ["<|image|>", 2 * (14 * 15 + 2)],
    ]
