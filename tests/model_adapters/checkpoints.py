"""Tiny checkpoints of every family that is run: our twins, and for `hf-vlm` families without code
of their own."""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import torch
from transformers import (
    DeepseekVLConfig,
    DeepseekVLForConditionalGeneration,
    Gemma3Config,
    Gemma3ForConditionalGeneration,
    Gemma3Processor,
    Idefics3Config,
    Idefics3ForConditionalGeneration,
    Idefics3Processor,
    LlavaConfig,
    LlavaForConditionalGeneration,
    LlavaProcessor,
)
from transformers.models.clip.image_processing_pil_clip import CLIPImageProcessorPil
from transformers.models.deepseek_vl.image_processing_pil_deepseek_vl import (
    DeepseekVLImageProcessorPil,
)
from transformers.models.deepseek_vl.processing_deepseek_vl import DeepseekVLProcessor
from transformers.models.gemma3.image_processing_pil_gemma3 import Gemma3ImageProcessorPil
from transformers.models.idefics3.image_processing_pil_idefics3 import Idefics3ImageProcessorPil

from model_adapters.built_in import BUILT_IN
from model_adapters.tiny.tokenizer import train_tokenizer
from model_adapters.tiny.twin import HEAD, HIDDEN, Twin

__all__ = [
    "FAMILIES",
    "OTHERS",
    "TEMPLATE",
    "TEXT",
    "VISION",
    "other_tokenizer",
    "save",
    "save_llava",
    "save_parts",
    "twin",
]

TEMPLATE = """\
{%- for message in messages -%}
{{- message.role + ': ' -}}
{%- for part in message.content -%}
{{- 'IMAGE' if part.type == 'image' else part.text -}}
{%- endfor -%}
{{- '\\n' -}}
{%- endfor -%}
{%- if add_generation_prompt -%}{{- 'assistant:' -}}{%- endif -%}
"""
TEXT = {
    "hidden_size": HIDDEN,
    "intermediate_size": 128,
    "num_hidden_layers": 2,
    "num_attention_heads": 4,
    "num_key_value_heads": 2,
    "head_dim": HEAD,
    "initializer_range": 0.2,
}
VISION = {
    "hidden_size": 32,
    "intermediate_size": 64,
    "num_hidden_layers": 3,
    "num_attention_heads": 2,
    "image_size": 56,
    "patch_size": 14,
}


def other_tokenizer(special: tuple[str, ...], **named: str) -> Any:
    """Train a tokenizer that begins texts with <s>; `named` are the tokens that processors look
    up."""
    return train_tokenizer(
        ("<s>", "</s>", *special), begin="<s>", end="</s>", pad="</s>", named=named
    )


def save_parts(folder: Path, model: Any, processor: Any) -> None:
    """Write a checkpoint of a model and its processor."""
    model.generation_config.eos_token_id = processor.tokenizer.eos_token_id
    model.generation_config.pad_token_id = processor.tokenizer.eos_token_id
    model.save_pretrained(folder)  # in the form of this transformers
    processor.save_pretrained(folder)


def save_llava(folder: Path, **text: Any) -> None:
    """Write a LLaVA; settings of the language model add to the usual ones or replace them."""
    tokenizer = other_tokenizer(("<image>",), image_token="<image>")
    config = LlavaConfig(
        image_token_index=tokenizer.convert_tokens_to_ids("<image>"),
        vision_config={"model_type": "clip_vision_model", "initializer_factor": 10.0, **VISION},
        text_config={"model_type": "llama", "vocab_size": len(tokenizer), **TEXT, **text},
    )
    processor = LlavaProcessor(
        CLIPImageProcessorPil(size={"shortest_edge": 56}, crop_size={"height": 56, "width": 56}),
        tokenizer,
        patch_size=14,
        vision_feature_select_strategy="default",
        num_additional_image_tokens=1,
        chat_template=TEMPLATE.replace("IMAGE", "<image>"),
    )
    save_parts(folder, LlavaForConditionalGeneration(config), processor)


def _idefics3(folder: Path) -> None:
    tiles = tuple(f"<row_{row}_col_{column}>" for row in range(1, 7) for column in range(1, 7))
    special = ("<image>", "<fake_token_around_image>", "<end_of_utterance>", "<global-img>", *tiles)
    tokenizer = other_tokenizer(special, image_token="<image>")
    config = Idefics3Config(
        image_token_id=tokenizer.convert_tokens_to_ids("<image>"),
        scale_factor=2,
        pad_token_id=tokenizer.eos_token_id,
        vision_config={"initializer_range": 0.2, **VISION},
        text_config={"model_type": "llama", "vocab_size": len(tokenizer), **TEXT},
    )
    processor = Idefics3Processor(
        Idefics3ImageProcessorPil(size={"longest_edge": 112}, max_image_size={"longest_edge": 56}),
        tokenizer,
        image_seq_len=4,
        chat_template=TEMPLATE.replace("IMAGE", "<image>"),
    )
    save_parts(folder, Idefics3ForConditionalGeneration(config), processor)


def _deepseek_vl(folder: Path) -> None:
    """The smaller DeepSeek-VL (1.3B), which has no tower for high resolution."""
    tokenizer = other_tokenizer(("<image_placeholder>",), image_token="<image_placeholder>")
    config = DeepseekVLConfig(
        image_token_id=tokenizer.convert_tokens_to_ids("<image_placeholder>"),
        tie_word_embeddings=False,
        vision_config={"model_type": "siglip_vision_model", "vision_use_head": False, **VISION},
        text_config={"model_type": "llama", "vocab_size": len(tokenizer), **TEXT},
    )
    processor = DeepseekVLProcessor(
        DeepseekVLImageProcessorPil(size={"height": 56, "width": 56}),
        tokenizer,
        num_image_tokens=16,
        chat_template=TEMPLATE.replace("IMAGE", "<image_placeholder>"),
    )
    save_parts(folder, DeepseekVLForConditionalGeneration(config), processor)


def _gemma3(folder: Path, line_breaks: tuple[str, ...] = ()) -> None:
    """Attends in both directions within an image, which no shared prefix of ours does.

    The published vocabulary has several line breaks as one token, which then joins frames and
    words.
    """
    names = {
        "boi_token": "<start_of_image>",
        "eoi_token": "<end_of_image>",
        "image_token": "<image_soft_token>",
    }
    tokenizer = other_tokenizer((*names.values(), *line_breaks), **names)
    ids = {name: tokenizer.convert_tokens_to_ids(token) for name, token in names.items()}
    config = Gemma3Config(
        image_token_index=ids["image_token"],
        boi_token_index=ids["boi_token"],
        eoi_token_index=ids["eoi_token"],
        mm_tokens_per_image=4,
        vision_config={"model_type": "siglip_vision_model", "vision_use_head": False, **VISION},
        text_config={
            "vocab_size": len(tokenizer),
            "sliding_window": 64,
            "query_pre_attn_scalar": HEAD,
            **TEXT,
        },
    )
    model = Gemma3ForConditionalGeneration(config)
    torch.nn.init.normal_(model.model.multi_modal_projector.mm_input_projection_weight, std=0.5)
    processor = Gemma3Processor(
        Gemma3ImageProcessorPil(size={"height": 56, "width": 56}, image_seq_length=4),
        tokenizer,
        image_seq_length=4,
        chat_template=TEMPLATE.replace("IMAGE", "<start_of_image>"),
    )
    save_parts(folder, model, processor)


FAMILIES = ("qwen2.5-vl", "llava-onevision", "deepseek-vl", "pixtral")
OTHERS: dict[str, Callable[[Path], None]] = {
    "llava": save_llava,
    "idefics3": _idefics3,
    "deepseek-vl-1.3b": _deepseek_vl,
    "gemma3": _gemma3,
    "gemma3-line-breaks": partial(_gemma3, line_breaks=("\n", "\n\n", "\n\n\n", "\n\n\n\n")),
}


def twin(family: str) -> Twin:
    """What the tiny model of one of our families is made from."""
    module, _, name = BUILT_IN[f"{family}-tiny"].adapter.partition(":")
    description: Twin = getattr(import_module(module), name).twin
    return description


def save(name: str, folder: Path) -> None:
    """Write the checkpoint of one of FAMILIES or OTHERS; the same weights every time."""
    if name in OTHERS:
        torch.manual_seed(0)
        OTHERS[name](folder)
    else:
        twin(name).save(folder, seed=0)
