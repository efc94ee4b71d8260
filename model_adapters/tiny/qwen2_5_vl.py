"""A Qwen2.5-VL of two layers with random weights: the real classes, template and frame tokens, without a download."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import torch
from transformers import (
    GenerationConfig,
    PreTrainedTokenizerBase,
    Qwen2_5_VLConfig,
    Qwen2_5_VLForConditionalGeneration,
)
from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

from model_adapters.engine.checkpoint import assemble, resolve_device, resolve_dtype
from model_adapters.engine.model import TransformersModel
from model_adapters.engine.options import EngineOptions
from model_adapters.families.qwen2_5_vl import Qwen25VLFamily, pixel_limits
from model_adapters.tiny.tokenizer import train_tokenizer

__all__ = ["Qwen25VLTiny", "TinyOptions", "save_tiny_checkpoint"]

_SPECIAL = (
    "<|endoftext|>",
    "<|im_start|>",
    "<|im_end|>",
    "<|vision_start|>",
    "<|vision_end|>",
    "<|vision_pad|>",
    "<|image_pad|>",
    "<|video_pad|>",
)

# Writes what Qwen2.5-VL's template writes for turns of text, images and videos.
_TEMPLATE = """\
{%- for message in messages -%}
{%- if loop.first and message.role != 'system' -%}
{{- '<|im_start|>system\\nYou are a helpful assistant.<|im_end|>\\n' -}}
{%- endif -%}
{{- '<|im_start|>' + message.role + '\\n' -}}
{%- if message.content is string -%}
{{- message.content -}}
{%- else -%}
{%- for part in message.content -%}
{%- if part.type == 'image' or 'image' in part or 'image_url' in part -%}
{{- '<|vision_start|><|image_pad|><|vision_end|>' -}}
{%- elif part.type == 'video' or 'video' in part -%}
{{- '<|vision_start|><|video_pad|><|vision_end|>' -}}
{%- elif 'text' in part -%}
{{- part.text -}}
{%- endif -%}
{%- endfor -%}
{%- endif -%}
{{- '<|im_end|>\\n' -}}
{%- endfor -%}
{%- if add_generation_prompt -%}
{{- '<|im_start|>assistant\\n' -}}
{%- endif -%}
"""


@dataclass(frozen=True, kw_only=True)
class TinyOptions(EngineOptions):
    """Options of qwen2.5-vl-tiny; its weights come from the run's seed.

    Attributes:
        dtype: float32 unless told otherwise, so that replies do not hang on rounding.
        device: cpu unless told otherwise.
        min_pixels: smaller frames are enlarged to this area.
        max_pixels: larger frames are reduced to this area.
    """

    dtype: str = "float32"
    device: str = "cpu"
    min_pixels: int | None = None
    max_pixels: int | None = None


class Qwen25VLTiny:
    """The adapter `qwen2.5-vl-tiny`."""

    Options = TinyOptions

    @classmethod
    def build(cls, name: str, options: TinyOptions, seed: int) -> TransformersModel:
        """Make a model with random weights of this seed."""
        tokenizer = _tokenizer()
        model = _model(tokenizer, seed, options.attn_implementation)
        dtype = resolve_dtype(options)
        model = model.to(resolve_device(options), torch.float32 if isinstance(dtype, str) else dtype)
        image_processor = Qwen2VLImageProcessorPil(**pixel_limits(options.min_pixels, options.max_pixels))
        origin = {"checkpoint": name, "seed": seed}
        family = Qwen25VLFamily(model, image_processor)
        loaded = assemble(model, tokenizer, image_processor, template=_TEMPLATE, family=family, origin=origin)
        return TransformersModel(name, loaded, options)


def save_tiny_checkpoint(folder: Path, seed: int) -> None:
    """Write the tiny model as a checkpoint that `qwen2.5-vl` and transformers' auto classes load.

    Args:
        folder: made if it does not exist.
        seed: of the weights.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tokenizer = _tokenizer()
    tokenizer.chat_template = _TEMPLATE
    tokenizer.save_pretrained(folder)
    _model(tokenizer, seed, "sdpa").save_pretrained(folder)
    Qwen2VLImageProcessorPil().save_pretrained(folder)
    # The full processor class cannot be built without torchvision; these are the files that it would write.
    video = {"video_processor_type": "Qwen2VLVideoProcessor", "processor_class": "Qwen2_5_VLProcessor"}
    for name, content in {
        "processor_config.json": {"processor_class": "Qwen2_5_VLProcessor"},
        "video_preprocessor_config.json": video,
    }.items():
        (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def _tokenizer() -> PreTrainedTokenizerBase:
    return train_tokenizer(_SPECIAL, end="<|im_end|>", pad="<|endoftext|>")


def _model(tokenizer: PreTrainedTokenizerBase, seed: int, attn_implementation: str) -> Any:
    ids = {token: cast(int, tokenizer.convert_tokens_to_ids(token)) for token in _SPECIAL}
    config = Qwen2_5_VLConfig(
        image_token_id=ids["<|image_pad|>"],
        video_token_id=ids["<|video_pad|>"],
        vision_start_token_id=ids["<|vision_start|>"],
        vision_end_token_id=ids["<|vision_end|>"],
        text_config={
            "vocab_size": len(tokenizer),
            "hidden_size": 64,
            "intermediate_size": 128,
            "num_hidden_layers": 2,
            "num_attention_heads": 4,
            "num_key_value_heads": 2,
            "max_position_embeddings": 128_000,
            "initializer_range": _SPREAD,
            "bos_token_id": None,
            "eos_token_id": ids["<|im_end|>"],
            "pad_token_id": ids["<|endoftext|>"],
            "rope_parameters": {"rope_type": "default", "rope_theta": 1e6, "mrope_section": [2, 3, 3]},
        },
        vision_config={
            "depth": 2,
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_heads": 2,
            "out_hidden_size": 64,
            "fullatt_block_indexes": [1],
            "initializer_range": _SPREAD,
        },
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = Qwen2_5_VLForConditionalGeneration._from_config(
            config, attn_implementation=attn_implementation, dtype=torch.float32
        )
    model.generation_config = GenerationConfig(
        eos_token_id=[ids["<|im_end|>"], ids["<|endoftext|>"]], pad_token_id=ids["<|endoftext|>"]
    )
    return model


# Wider than usual (0.02): with it, replies of a model without training differ from frame to frame.
_SPREAD = 0.2
