"""Chat templates in the public forms of the families, each from a few words."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["CHATML", "COHERE", "GEMMA3", "GEMMA4", "GLM", "MISTRAL", "VICUNA", "Chat", "headers"]

_TEMPLATE = """\
{{- START -}}
{%- set heads = HEADS -%}
{%- set tails = TAILS -%}
{%- set seen = namespace(images=0) -%}
{%- for message in messages -%}
{{- heads[message.role] -}}
{%- if message.content is string -%}
{{- message.content -}}
{%- else -%}
{%- for part in PARTS -%}
{%- if part.type == 'image' -%}
{%- set seen.images = seen.images + 1 -%}
{{- IMAGE -}}
{%- else -%}
{{- part.text -}}
{%- endif -%}
{%- endfor -%}
{%- endif -%}
{{- tails[message.role] -}}
{%- endfor -%}
{%- if add_generation_prompt -%}
{{- PROMPT -}}
{%- endif -%}
"""
_IN_ORDER = "message.content"
_IMAGES_FIRST = (
    "(message.content | selectattr('type', 'equalto', 'image') | list)"
    " + (message.content | rejectattr('type', 'equalto', 'image') | list)"
)


@dataclass(frozen=True, kw_only=True)
class Chat:
    """Form of a family's conversations.

    Attributes:
        special: special tokens of turns.
        begin: token that begins every text, or None.
        end: token that ends a turn of the assistant.
        pad: padding token.
        start: text before the first turn.
        heads: text before a turn, by role.
        tails: text behind a turn, by role.
        prompt: text that asks for a reply; the assistant's head where None.
        images_first: a turn's images are written before its texts.
    """

    special: tuple[str, ...]
    begin: str | None = None
    end: str
    pad: str
    start: str = ""
    heads: Mapping[str, str] = field(default_factory=dict)
    tails: Mapping[str, str] = field(default_factory=dict)
    prompt: str | None = None
    images_first: bool = False

    def template(self, image: str) -> str:
        """Return the Jinja template; `{n}` in the text of an image is its number, from 1."""
        before, *behind = map(json.dumps, image.split("{n}"))
        number = "".join(f" ~ seen.images ~ {text}" for text in behind)
        words = {
            "START": json.dumps(self.start),
            "HEADS": json.dumps({"system": "", "user": "", "assistant": "", **self.heads}),
            "TAILS": json.dumps({"system": "", "user": "", "assistant": "", **self.tails}),
            "PARTS": _IMAGES_FIRST if self.images_first else _IN_ORDER,
            "IMAGE": before + number,
            "PROMPT": json.dumps(self.heads["assistant"] if self.prompt is None else self.prompt),
        }
        template = _TEMPLATE
        for name, text in words.items():
            template = template.replace(name, text)
        return template


def headers(head: str, tail: str, **settings: Any) -> Chat:
    """Return a chat whose turns differ by the role's name alone, `{}` in `head`."""
    roles = ("system", "user", "assistant")
    heads = {role: head.format(role) for role in roles}
    return Chat(heads=heads, tails=dict.fromkeys(roles, tail), **settings)


CHATML = headers(
    "<|im_start|>{}\n",
    "<|im_end|>\n",
    special=("<|endoftext|>", "<|im_start|>", "<|im_end|>"),
    end="<|im_end|>",
    pad="<|endoftext|>",
)
GLM = headers(
    "<|{}|>\n",
    "",
    special=("<|endoftext|>", "[gMASK]", "<sop>", "<|system|>", "<|user|>", "<|assistant|>"),
    end="<|user|>",
    pad="<|endoftext|>",
    start="[gMASK]<sop>",
)
GEMMA3 = Chat(
    special=("<pad>", "<eos>", "<bos>", "<start_of_turn>", "<end_of_turn>"),
    begin="<bos>",
    end="<end_of_turn>",
    pad="<pad>",
    start="<bos>",
    heads={"user": "<start_of_turn>user\n", "assistant": "<start_of_turn>model\n"},
    tails=dict.fromkeys(("user", "assistant"), "<end_of_turn>\n"),
)
GEMMA4 = Chat(
    special=("<pad>", "<eos>", "<bos>", "<|turn>", "<turn|>"),
    begin="<bos>",
    end="<turn|>",
    pad="<pad>",
    start="<bos>",
    heads={"system": "<|turn>system\n", "user": "<|turn>user\n", "assistant": "<|turn>model\n"},
    tails=dict.fromkeys(("system", "user", "assistant"), "<turn|>\n"),
)
MISTRAL = Chat(
    special=("<s>", "</s>", "<pad>", "[INST]", "[/INST]", "[SYSTEM_PROMPT]", "[/SYSTEM_PROMPT]"),
    begin="<s>",
    end="</s>",
    pad="<pad>",
    start="<s>",
    heads={"system": "[SYSTEM_PROMPT]", "user": "[INST]"},
    tails={"system": "[/SYSTEM_PROMPT]", "user": "[/INST]", "assistant": "</s>"},
    prompt="",
)
COHERE = Chat(
    special=(
        "<PAD>",
        "<BOS_TOKEN>",
        "<|START_OF_TURN_TOKEN|>",
        "<|END_OF_TURN_TOKEN|>",
        "<|SYSTEM_TOKEN|>",
        "<|USER_TOKEN|>",
        "<|CHATBOT_TOKEN|>",
    ),
    begin="<BOS_TOKEN>",
    end="<|END_OF_TURN_TOKEN|>",
    pad="<PAD>",
    start="<BOS_TOKEN>",
    heads={
        "system": "<|START_OF_TURN_TOKEN|><|SYSTEM_TOKEN|>",
        "user": "<|START_OF_TURN_TOKEN|><|USER_TOKEN|>",
        "assistant": "<|START_OF_TURN_TOKEN|><|CHATBOT_TOKEN|>",
    },
    tails=dict.fromkeys(("system", "user", "assistant"), "<|END_OF_TURN_TOKEN|>"),
)
VICUNA = Chat(
    special=("<s>", "</s>", "<pad>"),
    begin="<s>",
    end="</s>",
    pad="<pad>",
    heads={"user": "USER: ", "assistant": "ASSISTANT: "},
    tails={"system": " ", "user": " ", "assistant": "</s>"},
    prompt="ASSISTANT:",
    images_first=True,
)
