"""The template that writes a conversation as text: the checkpoint's own, or a plain one without any roles."""

import json
from pathlib import Path
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family

__all__ = ["chat_template", "plain_template"]

# As checkpoints see it that were trained on bare sequences of texts and frames: what is said, and nothing else.
_PLAIN = """\
{%- for message in messages -%}
{%- for part in message.content -%}
{{- IMAGE if part.type == 'image' else part.text -}}
{%- endfor -%}
{%- endfor -%}
"""


def chat_template(folder: Path, tokenizer: Any) -> str:
    """The processor's template if the checkpoint has one of its own, else the tokenizer's.

    Args:
        folder: the checkpoint's.
        tokenizer: its tokenizer.

    Raises:
        ModelError: it has none.
    """
    jinja, legacy = folder / "chat_template.jinja", folder / "chat_template.json"
    if jinja.is_file():
        return jinja.read_text(encoding="utf-8")
    if legacy.is_file():
        template = json.loads(legacy.read_text(encoding="utf-8")).get("chat_template")
    else:
        template = tokenizer.chat_template
    if not isinstance(template, str):
        raise ModelError(f"{folder} has no chat template; add a chat_template.jinja to it, or ask with prompt=plain")
    return template


def plain_template(tokenizer: Any, family: Family) -> str:
    """A template that writes turns one after the other, texts and frames in their places.

    Args:
        tokenizer: the checkpoint's.
        family: knows what stands for a frame.
    """
    image = "".join(tokenizer.convert_ids_to_tokens(list(family.written_ids())))
    return _PLAIN.replace("IMAGE", json.dumps(image, ensure_ascii=False))
