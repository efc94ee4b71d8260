"""A Qwen2.5-VL of two layers with random weights, and the real template and frame tokens."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from transformers import Qwen2_5_VLConfig
from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.options.families import TinyPixelOptions
from model_adapters.tiny.twin import HIDDEN, SPREAD, TinyAdapter, Twin, text_config

SPECIAL = (
    "<|endoftext|>",
    "<|im_start|>",
    "<|im_end|>",
    "<|vision_start|>",
    "<|vision_end|>",
    "<|vision_pad|>",
    "<|image_pad|>",
    "<|video_pad|>",
)

# The same output as Qwen2.5-VL's template for turns of text, images and videos.
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


def _config(ids: Mapping[str, int], vocab_size: int) -> Any:
    return Qwen2_5_VLConfig(
        image_token_id=ids["<|image_pad|>"],
        video_token_id=ids["<|video_pad|>"],
        vision_start_token_id=ids["<|vision_start|>"],
        vision_end_token_id=ids["<|vision_end|>"],
        text_config=text_config(
            vocab_size,
            ids["<|im_end|>"],
            ids["<|endoftext|>"],
            max_position_embeddings=128_000,
            rope_parameters={"rope_type": "default", "rope_theta": 1e6, "mrope_section": [4, 6, 6]},
        ),
        vision_config={
            "depth": 2,
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_heads": 2,
            "out_hidden_size": HIDDEN,
            "fullatt_block_indexes": [1],
            "initializer_range": SPREAD,
        },
    )


class Qwen25VLTiny(TinyAdapter):
    """The adapter `qwen2.5-vl-tiny`."""

    Options = TinyPixelOptions
    twin = Twin(
        special=SPECIAL,
        end="<|im_end|>",
        pad="<|endoftext|>",
        image="<|image_pad|>",
        template=_TEMPLATE,
        config=_config,
        image_processor=Qwen2VLImageProcessorPil,
        family=Qwen25VLFamily,
        files={
            "processor_config.json": {"processor_class": "Qwen2_5_VLProcessor"},
            "video_preprocessor_config.json": {
                "video_processor_type": "Qwen2VLVideoProcessor",
                "processor_class": "Qwen2_5_VLProcessor",
            },
        },
    )


def save_tiny_checkpoint(folder: Path, seed: int) -> None:
    """Write the tiny Qwen2.5-VL as a checkpoint for `qwen2.5-vl` and transformers' auto classes."""
    Qwen25VLTiny.twin.save(folder, seed)
