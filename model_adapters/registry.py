"""Names of models, and how to get from a name to a model.

Targets are "module:Class" strings that are imported only when a model is asked for, so that listing names, and the
options of built-in models, costs nothing. Packages add their own through the entry point group `infthor_eval.models`; a
name may also be that of a file and a class in it, `./my_adapter.py:MyModel`.
"""

import dataclasses
import importlib
import re
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, cast

from infthor_eval.errors import ModelError, UsageError, unknown_name
from model_adapters.adapter_identity import package_identity
from model_adapters.built_in import BUILT_IN
from model_adapters.options import describe, parse
from model_adapters.own_file import class_in_file, class_name, identity_of_file, names_a_file
from model_adapters.protocols import Adapter, Model, Policy

__all__ = [
    "ENTRY_POINTS",
    "adapter_identity",
    "check_options",
    "has_option",
    "is_known",
    "label",
    "load",
    "model_note",
    "name_on_engine",
    "names",
    "options",
]

ENTRY_POINTS = "infthor_eval.models"

_TRANSFORMERS = "transformers"  # runs what no other engine is named for


def names() -> tuple[str, ...]:
    """All model names, sorted: the built-in ones and those of installed packages."""
    return tuple(sorted(_targets()))


def is_known(name: str) -> bool:
    """Whether there is a model of this name, or it is that of a file with one."""
    return name in _targets() or names_a_file(name)


def name_on_engine(name: str, engine: str) -> str:
    """The name of a model where an engine of one's choice is to run it.

    Args:
        name: of the model, with its engine or without.
        engine: `transformers`, or what stands behind the `@` of the names that it runs.

    Raises:
        UsageError: the engine does not run it; the message lists what it runs.
    """
    model, _, named = name.partition("@")
    if named and named != engine:
        raise UsageError(f"{name} names its engine, and it is not {engine}; leave one of them out")
    if engine == _TRANSFORMERS:
        return name
    known = [known.removesuffix(f"@{engine}") for known in names() if known.endswith(f"@{engine}")]
    if model not in known:
        raise UsageError(f"{model} does not run on {engine}; there do: {', '.join(known)}")
    return f"{model}@{engine}"


def options(name: str) -> str:
    """The model's options with their defaults, for people.

    Raises:
        UsageError: there is no model of this name.
        ModelError: the adapter cannot be imported.
    """
    return describe(_options(name))


def model_note(name: str) -> str:
    """What a user must know before running a model; empty for nothing, and for a model of another package."""
    return BUILT_IN[name].note if name in BUILT_IN else ""


def check_options(name: str, options: Mapping[str, str]) -> None:
    """Refuse at once what `load` would refuse, as far as names and values of options go.

    Raises:
        UsageError: an unknown name or option, or a value that does not fit.
        ModelError: the adapter cannot be imported.
    """
    parse(name, _options(name), options)


def load(name: str, options: Mapping[str, str], seed: int) -> Model | Policy:
    """Build the model or the policy of this name.

    Args:
        name: one of `names()`, or FILE.py:CLASS.
        options: the adapter's options as typed, `{"dtype": "float32"}`; what is left out takes its default.
        seed: for whatever is random in it (random weights).

    Raises:
        UsageError: an unknown name or option, or a value that does not fit; the message has the nearest name.
        ModelError: the model cannot be loaded.
    """
    adapter = _adapter(name)
    return adapter.build(class_name(name) if names_a_file(name) else name, parse(name, adapter.Options, options), seed)


def adapter_identity(name: str) -> dict[str, Any]:
    """What distinguishes this adapter's code from other versions of it, as JSON values.

    Nothing for a built-in one, whose version is the harness's own; else package (or file), version and a digest of the
    source.

    Raises:
        UsageError: there is no model of this name.
        ModelError: the adapter's source cannot be read.
    """
    if names_a_file(name):
        return identity_of_file(name)
    _target(name)
    return {} if name in BUILT_IN else package_identity(_entry_points()[name])


def has_option(name: str, option: str) -> bool:
    """Whether a model has an option.

    Raises:
        UsageError: there is no model of this name.
        ModelError: the adapter cannot be imported.
    """
    return option in {field.name for field in dataclasses.fields(_options(name))}


def label(name: str, options: Mapping[str, str]) -> str:
    """What a run of this model is called where nobody named it, fit to be a folder's name.

    Args:
        name: of the model.
        options: as typed; where they name a checkpoint, so does the label: `Qwen2.5-VL-3B-Instruct@main`. A server's
            model is named as the server does.
    """
    checkpoint = options.get("pretrained") or options.get("model")
    name = class_name(name) if names_a_file(name) else name
    if not checkpoint:
        return _as_component(name)
    revision = options.get("revision")
    return _as_component(_last_component(checkpoint) + (f"@{revision}" if revision else "")) or _as_component(name)


def _last_component(pretrained: str) -> str:
    path = Path(pretrained)
    if path.name in ("", ".."):
        path = path.resolve()
    # Every training run writes a folder of this name; the one above it says which run it was.
    return path.absolute().parent.name if path.name == "checkpoint" else path.name


def _as_component(text: str) -> str:
    return re.sub(r"[^\w.@+-]+", "-", text).strip(".-")


def _entry_points() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=ENTRY_POINTS)}


def _targets() -> dict[str, str]:
    # Built-in names win: a package cannot change what a known name means.
    return {name: point.value for name, point in _entry_points().items()} | {
        name: built_in.adapter for name, built_in in BUILT_IN.items()
    }


def _target(name: str) -> str:
    targets = _targets()
    if name not in targets:
        raise unknown_name("model", name, targets)
    return targets[name]


def _options(name: str) -> type:
    """The dataclass of a model's options; of a built-in one without its adapter, which may import torch."""
    if name not in BUILT_IN:
        return _adapter(name).Options
    found: type = _imported(BUILT_IN[name].options)
    return found


def _adapter(name: str) -> type[Adapter]:
    target = name if names_a_file(name) else _target(name)
    try:
        found = class_in_file(name) if names_a_file(name) else _imported(target)
    except (ImportError, AttributeError) as error:
        raise ModelError(f"model {name} cannot be imported from {target} ({error})") from error
    if not (hasattr(found, "Options") and hasattr(found, "build")):
        raise ModelError(f"model {name}: {target} has no Options and build; see docs/own-models.md")
    return cast(type[Adapter], found)


def _imported(target: str) -> Any:
    module, _, attribute = target.partition(":")
    return getattr(importlib.import_module(module), attribute)
