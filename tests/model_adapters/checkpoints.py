"""Tiny checkpoints of every family that is run: our twins, and for `hf-vlm` families without code
of their own, as the benchmarks make them."""

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from model_adapters.built_in import BUILT_IN
from model_adapters.tiny.twin import Twin

from ..helpers.benchmarks import FOLDER

__all__ = ["FAMILIES", "OTHERS", "save", "save_family", "save_llava", "twin"]

FAMILIES = ("qwen2.5-vl", "llava-onevision", "deepseek-vl", "pixtral")
# Their names in transformers. The smaller DeepSeek-VL has no tower for high resolution.
OTHERS = {
    "llava": "llava",
    "idefics3": "idefics3",
    "deepseek-vl-1.3b": "deepseek_vl",
    "nemotron-h-omni": "nemotron_h_omni",
    "gemma3": "gemma3",
    "gemma3-line-breaks": "gemma3",
}


@cache
def _benchmarks() -> tuple[Any, Any]:
    """Descriptions by transformers' name, and what writes them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        families = import_module("families").FAMILIES
        return families, import_module("tiny_families.checkpoint").save


def save_family(name: str, folder: Path, **changed: Any) -> None:
    """Write the checkpoint of a family of `benchmarks/families.py`, its description changed."""
    families, write = _benchmarks()
    write(name, replace(families[name], **changed), folder)


def save_llava(folder: Path, **text: Any) -> None:
    """Write a LLaVA; settings of the language model add to the usual ones or replace them."""
    usual = _benchmarks()[0]["llava"].config

    def config(vocabulary: Any) -> dict[str, Any]:
        settings = usual(vocabulary)
        return settings | {"text_config": settings["text_config"] | text}

    save_family("llava", folder, config=config)


def twin(family: str) -> Twin:
    """What the tiny model of one of our families is made from."""
    module, _, name = BUILT_IN[f"{family}-tiny"].adapter.partition(":")
    description: Twin = getattr(import_module(module), name).twin
    return description


def save(name: str, folder: Path) -> None:
    """Write the checkpoint of one of FAMILIES or OTHERS; the same weights every time."""
    if name == "gemma3-line-breaks":
        # The published vocabulary has several line breaks as one token, which then joins frames and
        # words.
        save_family("gemma3", folder, special=("\n", "\n\n", "\n\n\n", "\n\n\n\n"))
    elif name in OTHERS:
        # Frames in their places, where LLaVA's own template has them before the words.
        chat = replace(_benchmarks()[0][OTHERS[name]].chat, images_first=False)
        save_family(OTHERS[name], folder, chat=chat)
    else:
        twin(name).save(folder, seed=0)
