"""Parsing of options from the `k=v` strings of the command line."""

import dataclasses
import difflib
import typing
from collections.abc import Iterable, Mapping
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.settings import Declared, settings_of

_LARGEST = 2**63  # limit of the numbers in a run config
_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def describe(options: type) -> str:
    """Return the options with their defaults, as `a=1, b=x`, or "no options"."""
    declared = settings_of(options).items()
    return ", ".join(_with_default(name, each) for name, each in declared) or "no options"


def shown_default(declared: Declared) -> str:
    """Return the default of an option as it is typed, or that it must be given."""
    default = declared.default
    if default is dataclasses.MISSING:
        return "(required)"
    return str(default).lower() if default is None or isinstance(default, bool) else str(default)


def with_defaults(options: type, defaults: Mapping[str, Any]) -> type:
    """Return the options with other defaults for some of them."""
    if not defaults:
        return options
    hints = typing.get_type_hints(options, include_extras=True)
    return dataclasses.make_dataclass(
        options.__name__,
        [(name, hints[name], value) for name, value in defaults.items()],
        bases=(options,),
        frozen=True,
        kw_only=True,
    )


def parse(model: str, options: type, texts: Mapping[str, str]) -> Any:
    """Return an instance of the options with the given values, converted by the annotations.

    Args:
        model: name of the model, for the message.
        options: a dataclass, whose fields are str, int, float, bool, or one of these or None, with
            limits where they have some (`infthor_eval.settings`); one without a default must be
            given.
        texts: option names to values as typed.
    """
    known = settings_of(options)
    for name in texts:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ";"
            raise UsageError(
                f"{model} has no option {name}{hint} it takes: {describe(options)} (of several "
                f"models, MODEL:{name}=VALUE in --model gives it to one)"
            )
    for name, declared in known.items():
        if declared.default is dataclasses.MISSING and name not in texts:
            raise UsageError(
                f"{model}: the option {name} has no default; give it (--model-args "
                f"{name}=VALUE), or give its field a default"
            )
    try:
        return options(**{name: _value(name, known[name], text) for name, text in texts.items()})
    except ValueError as error:
        raise UsageError(f"{model}: {error}; it takes: {describe(options)}") from error


def _with_default(name: str, declared: Declared) -> str:
    default = shown_default(declared)
    is_required = declared.default is dataclasses.MISSING
    return f"{name} {default}" if is_required else f"{name}={default}"


def _value(name: str, declared: Declared, text: str) -> Any:
    if text.lower() in ("none", "") and declared.takes(None):
        return None
    try:
        value = _BOOLEANS[text.lower()] if declared.kind is bool else declared.kind(text)
    except (KeyError, ValueError):
        value = None
    too_large = declared.kind in (int, float) and value is not None and not abs(value) < _LARGEST
    if value is None or too_large or not declared.takes(value):
        raise ValueError(f"{name}={text}: give {declared.valid}")
    return value


def read_pairs(texts: Iterable[str], option: str) -> dict[str, str]:
    """Return keys and values written as `k=v`; messages name the option that they belong to."""
    pairs: dict[str, str] = {}
    for text in filter(None, (part.strip() for part in texts)):
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise UsageError(f"{option}: {text!r} is not of the form key=value")
        if key.strip() in pairs:
            raise UsageError(f"{option}: {key.strip()!r} is given twice")
        pairs[key.strip()] = value.strip()
    return pairs
