"""Processors and models that do things their own way: which token of theirs stands for a frame,
what they write around it, and whether their `generate` obeys."""

import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from PIL import Image
from transformers import (
    Cohere2VisionProcessor,
    Idefics2Config,
    Idefics2ForConditionalGeneration,
    Idefics2Processor,
    JanusConfig,
    JanusForConditionalGeneration,
    JanusProcessor,
    MllamaConfig,
    MllamaForConditionalGeneration,
    MllamaProcessor,
    PaliGemmaConfig,
    PaliGemmaForConditionalGeneration,
    PaliGemmaProcessor,
)
from transformers.models.got_ocr2.image_processing_pil_got_ocr2 import GotOcr2ImageProcessorPil
from transformers.models.idefics2.image_processing_pil_idefics2 import Idefics2ImageProcessorPil
from transformers.models.janus.image_processing_pil_janus import JanusImageProcessorPil
from transformers.models.mllama.image_processing_pil_mllama import MllamaImageProcessorPil
from transformers.models.siglip.image_processing_pil_siglip import SiglipImageProcessorPil

import model_adapters
from infthor_eval.errors import ModelError
from model_adapters import load
from model_adapters.hf.uncached import expand_image_tokens, image_token

from ...asking import up_to
from ...checkpoints import TEMPLATE, TEXT, VISION, other_tokenizer, save_llava, save_parts
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
LLAMA = {"model_type": "llama", "initializer_range": 0.2, **TEXT}


def _load(folder, **options):
    return load("hf-vlm", {"pretrained": str(folder), "device": "cpu", **options}, seed=0)


def _janus(folder):
    names = {"image_token": "<image>", "boi_token": "<boi>", "eoi_token": "<eoi>"}
    tokenizer = other_tokenizer(tuple(names.values()), **names)
    config = JanusConfig(
        image_token_id=tokenizer.convert_tokens_to_ids("<image>"),
        text_config={"vocab_size": len(tokenizer), **LLAMA},
        vision_config={**VISION, "projection_dim": TEXT["hidden_size"], "num_image_tokens": 16},
        vq_config={
            "base_channels": 32,
            "channel_multiplier": [1],
            "num_embeddings": 16,
            "num_patches": 4,
            "projection_dim": TEXT["hidden_size"],
            "image_token_embed_dim": TEXT["hidden_size"],
            "num_res_blocks": 1,
        },
    )
    processor = JanusProcessor(
        JanusImageProcessorPil(size=SIZE, min_size=14),
        tokenizer,
        num_image_tokens=16,
        chat_template=TEMPLATE.replace("IMAGE", "<image>"),
    )
    save_parts(folder, JanusForConditionalGeneration(config), processor)


def _idefics2(folder):
    names = {"image_token": "<image>", "image_boundary_token": "<fake_token_around_image>"}
    tokenizer = other_tokenizer((*names.values(), "<end_of_utterance>"), **names)
    config = Idefics2Config(
        image_token_id=tokenizer.convert_tokens_to_ids("<image>"),
        vision_config=VISION,
        perceiver_config={
            "hidden_size": TEXT["hidden_size"],
            "resampler_n_latents": 4,
            "resampler_depth": 1,
            "resampler_n_heads": 2,
            "resampler_head_dim": 16,
            "num_key_value_heads": 1,
        },
        text_config={**LLAMA, "model_type": "mistral", "vocab_size": len(tokenizer)},
    )
    processor = Idefics2Processor(
        Idefics2ImageProcessorPil(
            size={"shortest_edge": 28, "longest_edge": 56}, do_image_splitting=False
        ),
        tokenizer,
        image_seq_len=4,
        chat_template=TEMPLATE.replace("IMAGE", "<image>"),
    )
    save_parts(folder, Idefics2ForConditionalGeneration(config), processor)


def _mllama(folder):
    tokenizer = other_tokenizer(("<|python_tag|>", "<|image|>"), image_token="<|image|>")
    config = MllamaConfig(
        image_token_index=tokenizer.convert_tokens_to_ids("<|image|>"),
        vision_config={
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_global_layers": 1,
            "attention_heads": 2,
            "image_size": 56,
            "vision_output_dim": 64,
            "intermediate_layers_indices": [0],
            "max_num_tiles": 4,
        },
        text_config={
            **LLAMA,
            "model_type": "mllama_text_model",
            "vocab_size": len(tokenizer),
            "cross_attention_layers": [1],
            "pad_token_id": tokenizer.pad_token_id,
        },
    )
    processor = MllamaProcessor(
        MllamaImageProcessorPil(size=SIZE, max_image_tiles=4),
        tokenizer,
        chat_template=TEMPLATE.replace("IMAGE", "<|image|>"),
    )
    save_parts(folder, MllamaForConditionalGeneration(config), processor)


def _paligemma(folder):
    tokenizer = other_tokenizer(("<image>",), image_token="<image>")
    images = SiglipImageProcessorPil(size=SIZE)
    images.image_seq_length = 16
    processor = PaliGemmaProcessor(
        images, tokenizer, chat_template=TEMPLATE.replace("IMAGE", "<image>")
    )
    config = PaliGemmaConfig(
        image_token_index=tokenizer.convert_tokens_to_ids("<image>"),
        projection_dim=TEXT["hidden_size"],
        hidden_size=TEXT["hidden_size"],
        vision_config={
            "model_type": "siglip_vision_model",
            "vision_use_head": False,
            "projection_dim": TEXT["hidden_size"],
            **VISION,
        },
        text_config={**LLAMA, "model_type": "gemma", "vocab_size": len(tokenizer)},
    )
    save_parts(folder, PaliGemmaForConditionalGeneration(config), processor)


SLOTS = {_idefics2: 4 + 1, _mllama: 1, _paligemma: 16}  # and a marker between two frames


@pytest.mark.parametrize("save", SLOTS, ids=lambda save: save.__name__)
def test_a_frame_has_the_tokens_that_one_more_takes(save, tmp_path, frames):
    torch.manual_seed(0)
    save(tmp_path)
    model = _load(tmp_path, share_prefix="false")
    assert model.tokens_per_frame(frames[0]) == SLOTS[save]
    counts = []
    for n in (1, 2, 3):
        talk = model.conversation()
        talk.append(*frames[:n], "\nWhat is it?")
        counts.append(talk.n_tokens)
    assert {later - earlier for earlier, later in itertools.pairwise(counts)} == {SLOTS[save]}


def test_a_generate_that_chooses_its_own_tokens_is_refused(tmp_path):
    torch.manual_seed(0)
    _janus(tmp_path)
    with pytest.raises(
        ModelError, match=r"^JanusForCond.*generate returns other tokens .* use share_prefix=true$"
    ):
        _load(tmp_path, share_prefix="false")


def test_janus_replies_as_its_generate_with_shared_prefixes(tmp_path, frames):
    torch.manual_seed(0)
    _janus(tmp_path)
    model = _load(tmp_path)
    talk = model.conversation()
    talk.append(frames[0], "\nWhat is it?")
    reply = talk.reply(up_to(4))
    assert reply.n_reply_tokens > 0
    assert model.tokens_per_frame(frames[0]) == 16 + 2


@pytest.mark.parametrize("save", [_idefics2, _mllama, _paligemma], ids=lambda save: save.__name__)
def test_an_architecture_that_would_be_run_wrongly_is_refused(save, tmp_path):
    torch.manual_seed(0)
    save(tmp_path)
    with pytest.raises(ModelError, match=r"with shared prefixes.*; use share_prefix=false"):
        _load(tmp_path)


def test_a_processor_expands_its_image_token_and_not_the_marker_of_its_begin():
    names = {"image_token": "<image>", "boi_token": "<boi>", "eoi_token": "<eoi>"}
    tokenizer = other_tokenizer((*names.values(), "<line>"), **names, img_line_break_token="<line>")
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
    talk = _load(tmp_path, share_prefix="false").conversation()
    talk.append(frames[0], "\nWhat is it?")
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
