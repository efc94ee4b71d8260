"""A Pixtral of two layers with random weights; frames take as many tokens as in the real one."""

from collections.abc import Mapping
from typing import Any

from transformers import LlavaConfig
from transformers.models.pixtral.image_processing_pil_pixtral import PixtralImageProcessorPil

from model_adapters.hf.families.pixtral import PixtralFamily
from model_adapters.tiny.twin import HEAD, SPREAD, TinyAdapter, Twin, text_config

_TEMPLATE = """\
{{- bos_token -}}
{%- for message in messages -%}
{{- '[INST]' if message.role == 'user' else '' -}}
{%- if message.content is string -%}
{{- message.content -}}
{%- else -%}
{%- for part in message.content -%}
{{- '[IMG]' if part.type == 'image' else part.text -}}
{%- endfor -%}
{%- endif -%}
{{- '[/INST]' if message.role == 'user' else eos_token -}}
{%- endfor -%}
"""


def _config(ids: Mapping[str, int], vocab_size: int) -> Any:
    return LlavaConfig(
        image_token_index=ids["[IMG]"],
        image_seq_length=1,
        vision_feature_layer=-1,
        vision_feature_select_strategy="full",
        text_config=text_config(
            vocab_size,
            ids["</s>"],
            ids["<pad>"],
            model_type="mistral",
            head_dim=HEAD,
            max_position_embeddings=131_072,
            sliding_window=None,
            bos_token_id=ids["<s>"],
        ),
        vision_config={
            "model_type": "pixtral",
            "image_size": 1024,
            "patch_size": 16,
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "initializer_range": SPREAD,
        },
    )


class PixtralTiny(TinyAdapter):
    """The adapter `pixtral-tiny`."""

    twin = Twin(
        special=("<s>", "</s>", "<pad>", "[INST]", "[/INST]", "[IMG]", "[IMG_BREAK]", "[IMG_END]"),
        begin="<s>",
        end="</s>",
        pad="<pad>",
        image="[IMG]",
        template=_TEMPLATE,
        config=_config,
        image_processor=PixtralImageProcessorPil,
        family=PixtralFamily,
        files={"processor_config.json": {"processor_class": "PixtralProcessor", "patch_size": 16}},
    )
