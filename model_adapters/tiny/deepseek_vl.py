"""A DeepSeek-VL hybrid of two layers with random weights; frames take the real number of tokens.

Its high-resolution tower reads 256 pixels instead of 1024, and its features are interpolated to the
same 24 x 24.
"""

from collections.abc import Mapping
from typing import Any

from transformers import DeepseekVLHybridConfig
from transformers.models.deepseek_vl_hybrid.image_processing_pil_deepseek_vl_hybrid import (
    DeepseekVLHybridImageProcessorPil,
)

from model_adapters.hf.families.deepseek_vl import DeepseekVLFamily
from model_adapters.tiny.twin import SPREAD, TinyAdapter, Twin, siglip_config, text_config

_BEGIN = "<｜begin▁of▁sentence｜>"
_END = "<｜end▁of▁sentence｜>"

_TEMPLATE = """\
{{- 'You are a helpful language and vision assistant.\\n\\n' -}}
{%- for message in messages -%}
{{- 'User: ' if message.role == 'user' else 'Assistant: ' -}}
{%- if message.content is string -%}
{{- message.content -}}
{%- else -%}
{%- for part in message.content -%}
{{- '<image_placeholder>' if part.type == 'image' else part.text -}}
{%- endfor -%}
{%- endif -%}
{{- '\\n\\n' if message.role == 'user' else eos_token -}}
{%- endfor -%}
{%- if add_generation_prompt -%}
{{- 'Assistant:' -}}
{%- endif -%}
"""


def _config(ids: Mapping[str, int], vocab_size: int) -> Any:
    return DeepseekVLHybridConfig(
        image_token_id=ids["<image_placeholder>"],
        tie_word_embeddings=False,
        text_config=text_config(
            vocab_size,
            ids[_END],
            ids[_END],
            model_type="llama",
            num_key_value_heads=4,
            max_position_embeddings=16_384,
            bos_token_id=ids[_BEGIN],
        ),
        vision_config=siglip_config(patch_size=16),
        high_res_vision_config={
            "model_type": "sam_vision_model",
            "image_size": 256,
            "patch_size": 16,
            "hidden_size": 16,
            "output_channels": 8,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "window_size": 8,
            "global_attn_indexes": [1],
            "mlp_dim": 32,
            "initializer_range": SPREAD,
        },
    )


class DeepseekVLTiny(TinyAdapter):
    """The adapter `deepseek-vl-tiny`."""

    twin = Twin(
        special=(_BEGIN, _END, "<image_placeholder>"),
        begin=_BEGIN,
        end=_END,
        pad=_END,
        image="<image_placeholder>",
        template=_TEMPLATE,
        config=_config,
        image_processor=DeepseekVLHybridImageProcessorPil,
        image_settings={"high_res_size": {"height": 256, "width": 256}},
        family=DeepseekVLFamily,
        files={
            "processor_config.json": {
                "processor_class": "DeepseekVLHybridProcessor",
                "num_image_tokens": 576,
            }
        },
    )
