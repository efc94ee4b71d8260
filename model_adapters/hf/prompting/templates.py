"""Templates of conversations: the checkpoint's chat template, or a plain one without roles."""

import json
from pathlib import Path
from typing import Any

from transformers import ProcessorMixin

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family

# The form of prompts in training on bare sequences of texts and frames.
_PLAIN = """\
{%- for message in messages -%}
{%- for part in message.content -%}
{{- IMAGE if part.type == 'image' else VIDEO if part.type == 'video' else part.text -}}
{%- endfor -%}
{%- endfor -%}
"""


def chat_template(folder: Path, tokenizer: Any) -> str:
    """Return the processor's chat template if the checkpoint has one, else the tokenizer's; of
    named ones the default.
    """
    settings, _ = ProcessorMixin.get_processor_dict(folder)
    template = settings.get("chat_template") or tokenizer.chat_template
    if isinstance(template, list):
        template = {named["name"]: named["template"] for named in template}
    lacks = ""
    if isinstance(template, dict):
        lacks = f" named default (but {', '.join(sorted(template))})"
        template = template.get("default")
    if not isinstance(template, str):
        raise ModelError(
            f"{folder} has no chat template{lacks}; add a chat_template.jinja to it, or set "
            "prompt=plain"
        )
    return template


def plain_template(tokenizer: Any, family: Family) -> str:
    """Return a template that concatenates the parts of all turns; the family knows the tokens of
    frames and videos."""
    placeholders = {
        "IMAGE": family.placeholder_id,
        "VIDEO": None if family.video is None else family.video.placeholder_id,
    }
    template = _PLAIN
    for name, placeholder in placeholders.items():
        ids = [] if placeholder is None else list(family.template_ids(placeholder))
        template = template.replace(
            name, json.dumps("".join(tokenizer.convert_ids_to_tokens(ids)), ensure_ascii=False)
        )
    return template
