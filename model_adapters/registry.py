"""Names of models, and how to build a model by its name.

Adapters are "module:Class" strings that are imported only when a model is needed, so that listing
names, and the options of built-in models, is fast. Packages add theirs by the entry point group
`infthor_eval.models`. A name may also be a file and a class or a function in it,
`./my_adapter.py:MyModel`.
"""

import inspect
import re
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, cast

from infthor_eval.errors import ModelError, UsageError, unknown_name
from infthor_eval.plugins import import_target
from infthor_eval.settings import Declared, settings_of
from model_adapters.adapter_identity import package_identity
from model_adapters.built_in import BUILT_IN
from model_adapters.check.clauses import ContractError, check_members
from model_adapters.functions import function_adapter
from model_adapters.guarded import guard
from model_adapters.options import parse, with_defaults
from model_adapters.own_file import file_identity, load_from_file, name_in_file, names_a_file
from model_adapters.protocols import Adapter, FramePolicy, Model, Policy
from model_adapters.refusals import wrap_adapter_errors

ENTRY_POINTS = "infthor_eval.models"

_TRANSFORMERS = "transformers"  # the engine of names without `@ENGINE`
_HELP = "docs/own-models.md lists what an adapter needs"


def names() -> tuple[str, ...]:
    """Return all model names, sorted: the built-in ones and those of installed packages."""
    return tuple(sorted(_targets()))


def is_known(name: str) -> bool:
    """Return whether this is the name of a model, or of a file and a class in it."""
    return name in _targets() or names_a_file(name)


def name_on_engine(name: str, engine: str) -> str:
    """Return the name of a model on a given engine.

    Args:
        name: name of the model, with or without its engine.
        engine: `transformers`, or an engine that follows the `@` in some model names.

    Raises:
        UsageError: the engine does not run the model; the message lists the models that it runs.
    """
    model, _, own_engine = name.partition("@")
    if own_engine and own_engine != engine:
        raise UsageError(f"{name} names its engine, and it is not {engine}; leave one of them out")
    if engine == _TRANSFORMERS:
        return name
    supported = [
        known.removesuffix(f"@{engine}") for known in names() if known.endswith(f"@{engine}")
    ]
    if model not in supported:
        raise UsageError(f"{model} does not run on {engine}; these do: {', '.join(supported)}")
    return f"{model}@{engine}"


def model_description(name: str) -> str:
    """Return what a model is, in a few words, or an empty text if its name says so."""
    return BUILT_IN[name].description if name in BUILT_IN else ""


def options_of(name: str) -> dict[str, Declared]:
    """Return the model's options by name, with types, defaults, and what each does.

    Raises:
        UsageError: the name is unknown.
        ModelError: the adapter cannot be imported.
    """
    return settings_of(_options(name))


def model_note(name: str) -> str:
    """Return a warning for users of a model, or an empty text."""
    return BUILT_IN[name].note if name in BUILT_IN else ""


def check_options(name: str, options: Mapping[str, str]) -> None:
    """Check names and values of options as `load` does, without loading the model.

    Raises:
        UsageError: a name is unknown, or a value does not fit its option.
        ModelError: the adapter cannot be imported.
    """
    read_options(name, options)


def read_options(name: str, options: Mapping[str, str]) -> Any:
    """Return the options that a model's adapter is given, of the adapter's own type."""
    return parse(name, _options(name), options)


def load(name: str, options: Mapping[str, str], seed: int) -> Model | Policy | FramePolicy:
    """Build the model or policy of this name; one that is not built in is behind a guard.

    Args:
        name: one of `names()`, or FILE.py:CLASS.
        options: values of the adapter's options as typed, `{"dtype": "float32"}`; the others take
            their defaults.
        seed: seed of whatever is random in the model (random weights).

    Raises:
        UsageError: a name is unknown (the message has the nearest one), or a value does not fit its
            option.
        ModelError: the model cannot be loaded, lacks a member, or has no name or
            capabilities.
    """
    model = build(name, options, seed)
    if name in BUILT_IN:
        return model
    with wrap_adapter_errors(f"model {name}: conversation() fails"):
        try:
            check_members(model)
        except ContractError as error:
            raise ModelError(f"model {name}: {error}; {_HELP}") from error
    return guard(name, model)


def build(name: str, options: Mapping[str, str], seed: int) -> Model | Policy | FramePolicy:
    """Build the model or the policy of this name without checking its members; see `load`."""
    adapter = _adapter(name)
    parsed = read_options(name, options)
    if name in BUILT_IN:
        return adapter.build(name, parsed, seed)
    with wrap_adapter_errors(f"model {name}: build() fails"):
        return adapter.build(name_in_file(name) if names_a_file(name) else name, parsed, seed)


def adapter_identity(name: str) -> dict[str, Any]:
    """Return what distinguishes this adapter's code from other versions of it, as JSON values.

    It is empty for a built-in adapter, whose version is that of the harness. For others it has the
    package (or file), its version and a digest of its source.

    Raises:
        UsageError: the name is unknown.
        ModelError: the adapter's source cannot be read.
    """
    if names_a_file(name):
        return file_identity(name)
    _target(name)
    return {} if name in BUILT_IN else package_identity(_entry_points()[name])


def has_option(name: str, option: str) -> bool:
    """Return whether a model has an option.

    Raises:
        UsageError: the name is unknown.
        ModelError: the adapter cannot be imported.
    """
    return option in options_of(name)


def switches(name: str) -> tuple[str, ...]:
    """Return a model's options that are to save time or memory and to change no reply: the class
    attribute `switches` of its options.

    Raises:
        UsageError: the name is unknown.
        ModelError: the adapter cannot be imported.
    """
    return tuple(getattr(_options(name), "switches", ()))


def switched_on(name: str, options: Mapping[str, str]) -> dict[str, str]:
    """Return those of a model's options as typed that are switches and have not their defaults.

    Raises:
        UsageError: a name is unknown, or a value does not fit its option.
        ModelError: the adapter cannot be imported.
    """
    parsed = read_options(name, options)
    known = settings_of(type(parsed))
    return {
        option: options[option]
        for option in switches(name)
        if option in options and getattr(parsed, option) != known[option].default
    }


def label(name: str, options: Mapping[str, str]) -> str:
    """Return the default name of this model's runs, usable as the name of a folder.

    Args:
        name: name of the model.
        options: its options as typed. If they name a checkpoint, so does the label:
            `Qwen2.5-VL-3B-Instruct@main`. The label of a model behind a server is the server's name
            of it.
    """
    checkpoint = options.get("pretrained") or options.get("model")
    name = name_in_file(name) if names_a_file(name) else name
    if not checkpoint:
        return _as_component(name)
    revision = options.get("revision")
    return _as_component(
        _last_component(checkpoint) + (f"@{revision}" if revision else "")
    ) or _as_component(name)


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
    """Return the dataclass of a model's options, without importing a built-in adapter, which may
    import torch."""
    if name not in BUILT_IN:
        return _adapter(name).Options
    built_in = BUILT_IN[name]
    return with_defaults(cast(type, import_target(built_in.options)), built_in.defaults)


def _adapter(name: str) -> type[Adapter]:
    target = name if names_a_file(name) else _target(name)
    try:
        adapter = load_from_file(name) if names_a_file(name) else import_target(target)
    except (ImportError, AttributeError) as error:
        raise ModelError(f"model {name} cannot be imported from {target} ({error})") from error
    if names_a_file(name) and inspect.isfunction(adapter):
        return cast(type[Adapter], function_adapter(name, adapter))
    missing = [member for member in ("Options", "build") if not hasattr(adapter, member)]
    if missing:
        raise ModelError(f"model {name}: {target} has no {' and '.join(missing)}; {_HELP}")
    return cast(type[Adapter], adapter)
