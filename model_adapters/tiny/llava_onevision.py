"""A LLaVA-OneVision of two layers, random weights; frames take the real number of tokens."""

from collections.abc import Mapping
from typing import Any

from transformers import LlavaOnevisionConfig
from transformers.models.llava_onevision.image_processing_pil_llava_onevision import (
    LlavaOnevisionImageProcessorPil,
)

from model_adapters.hf.families.llava_onevision import LlavaOnevisionFamily
from model_adapters.tiny.twin import TinyAdapter, Twin, siglip_config, text_config

# Like the family's template: images first, then each text on its own line.
_TEMPLATE = """\
{%- for message in messages -%}
{{- '<|im_start|>' + message.role + ' ' -}}
{%- if message.content is string -%}
{{- '\\n' + message.content -}}
{%- else -%}
{%- for part in message.content if part.type == 'image' -%}{{- '<image>' -}}{%- endfor -%}
{%- for part in message.content if part.type == 'video' -%}{{- '<video>' -}}{%- endfor -%}
{%- for part in message.content if part.type == 'text' -%}{{- '\\n' + part.text -}}{%- endfor -%}
{%- endif -%}
{{- '<|im_end|>' -}}
{%- endfor -%}
{%- if add_generation_prompt -%}
{{- '<|im_start|>assistant\\n' -}}
{%- endif -%}
"""


def _config(ids: Mapping[str, int], vocab_size: int) -> Any:
    return LlavaOnevisionConfig(
        image_token_index=ids["<image>"],
        video_token_index=ids["<video>"],
        text_config=text_config(
            vocab_size,
            ids["<|im_end|>"],
            ids["<|endoftext|>"],
            model_type="qwen2",
            max_position_embeddings=32_768,
        ),
        vision_config=siglip_config(patch_size=14),
    )


class LlavaOnevisionTiny(TinyAdapter):
    """The adapter `llava-onevision-tiny`."""

    twin = Twin(
        special=("<|endoftext|>", "<|im_start|>", "<|im_end|>", "<image>", "<video>"),
        end="<|im_end|>",
        pad="<|endoftext|>",
        image="<image>",
        template=_TEMPLATE,
        config=_config,
        image_processor=LlavaOnevisionImageProcessorPil,
        family=LlavaOnevisionFamily,
        files={
            "processor_config.json": {
                "processor_class": "LlavaOnevisionProcessor",
                "num_image_tokens": 729,
                "vision_feature_select_strategy": "full",
                "vision_aspect_ratio": "anyres_max_9",
            },
            "video_preprocessor_config.json": {
                "video_processor_type": "LlavaOnevisionVideoProcessor",
                "processor_class": "LlavaOnevisionProcessor",
            },
        },
    )
