"""Names of models, and how to get from a name to a model.

Targets are "module:Class" strings that are imported only when a model is asked for, so that listing names costs
nothing. Packages add their own through the entry point group `infthor_eval.models`.
"""

import difflib
import importlib
from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import cast

from infthor_eval.errors import ModelError, UsageError
from model_adapters.options import describe, parse
from model_adapters.protocols import Adapter, Bound, Model

__all__ = ["ENTRY_POINTS", "check_options", "load", "names", "options"]

ENTRY_POINTS = "infthor_eval.models"

_BUILT_IN = {
    "blind": "model_adapters.bounds:Blind",
    "deepseek-vl": "model_adapters.hf.families.deepseek_vl:DeepseekVL",
    "deepseek-vl-tiny": "model_adapters.tiny.deepseek_vl:DeepseekVLTiny",
    "hf-vlm": "model_adapters.hf.families.hf_vlm:HfVlm",
    "llava-onevision": "model_adapters.hf.families.llava_onevision:LlavaOnevision",
    "llava-onevision-tiny": "model_adapters.tiny.llava_onevision:LlavaOnevisionTiny",
    "oracle": "model_adapters.bounds:Oracle",
    "pixtral": "model_adapters.hf.families.pixtral:Pixtral",
    "pixtral-tiny": "model_adapters.tiny.pixtral:PixtralTiny",
    "qwen2.5-vl": "model_adapters.hf.families.qwen2_5_vl:Qwen25VL",
    "qwen2.5-vl-tiny": "model_adapters.tiny.qwen2_5_vl:Qwen25VLTiny",
    "random": "model_adapters.bounds:Random",
}


def names() -> tuple[str, ...]:
    """All model names, sorted: the built-in ones and those of installed packages."""
    return tuple(sorted(_targets()))


def options(name: str) -> str:
    """The model's options with their defaults, for people.

    Raises:
        UsageError: there is no model of this name.
        ModelError: the adapter cannot be imported.
    """
    return describe(_adapter(name).Options)


def check_options(name: str, options: Mapping[str, str]) -> None:
    """Refuse at once what `load` would refuse, as far as names and values of options go.

    Raises:
        UsageError: an unknown name or option, or a value that does not fit.
        ModelError: the adapter cannot be imported.
    """
    parse(name, _adapter(name).Options, options)


def load(name: str, options: Mapping[str, str], seed: int) -> Model | Bound:
    """Build the model of this name.

    Args:
        name: one of `names()`.
        options: the adapter's options as typed, `{"dtype": "float32"}`; what is left out takes its default.
        seed: for whatever is random in the model (random weights, random answers).

    Raises:
        UsageError: an unknown name or option, or a value that does not fit; the message has the nearest name.
        ModelError: the model cannot be loaded.
    """
    adapter = _adapter(name)
    return adapter.build(name, parse(name, adapter.Options, options), seed)


def _targets() -> dict[str, str]:
    # Built-in names win: a package cannot change what a known name means.
    return {point.name: point.value for point in entry_points(group=ENTRY_POINTS)} | _BUILT_IN


def _adapter(name: str) -> type[Adapter]:
    targets = _targets()
    if name not in targets:
        near = difflib.get_close_matches(name, targets, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}? " if near else ""
        raise UsageError(f"there is no model {name}; {hint}models: {', '.join(sorted(targets))}")
    module, _, attribute = targets[name].partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ModelError(f"model {name} cannot be imported from {targets[name]} ({error})") from error
    if not (hasattr(found, "Options") and hasattr(found, "build")):
        raise ModelError(f"model {name}: {targets[name]} has no Options and build; see model_adapters.Adapter")
    return cast(type[Adapter], found)
