"""Parsing of options from the `k=v` strings of the command line."""

import dataclasses
import difflib
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any

from infthor_eval.errors import UsageError

_LARGEST = 2**63  # limit of the numbers in a run config
_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


@dataclasses.dataclass(frozen=True)
class NoOptions:
    """Options of an adapter without options."""


def describe(options: type) -> str:
    """Return the options with their defaults, as `a=1, b=x`, or "no options"."""
    texts = []
    for field in dataclasses.fields(options):
        if is_required(field):
            texts.append(f"{field.name} (required)")
            continue
        default = field.default_factory() if callable(field.default_factory) else field.default
        is_keyword = default is None or isinstance(default, bool)
        texts.append(f"{field.name}={str(default).lower() if is_keyword else default}")
    return ", ".join(texts) or "no options"


def is_required(field: dataclasses.Field[Any]) -> bool:
    """Return whether an option has no default."""
    missing = dataclasses.MISSING
    return field.init and field.default is missing and field.default_factory is missing


def with_defaults(options: type, defaults: Mapping[str, Any]) -> type:
    """Return the options with other defaults for some of them."""
    if not defaults:
        return options
    hints = typing.get_type_hints(options)
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
        options: a dataclass, whose fields are str, int, float, bool, or one of these or None; one
            without a default must be given.
        texts: option names to values as typed.
    """
    hints = typing.get_type_hints(options)
    for name in texts:
        if name not in hints:
            near = difflib.get_close_matches(name, hints, n=1)
            hint = f"; did you mean {near[0]}?" if near else ";"
            raise UsageError(
                f"{model} has no option {name}{hint} it takes: {describe(options)} (of several "
                f"models, MODEL:{name}=VALUE in --model gives it to one)"
            )
    for field in dataclasses.fields(options):
        if is_required(field) and field.name not in texts:
            raise UsageError(
                f"{model}: the option {field.name} has no default; give it (--model-args "
                f"{field.name}=VALUE), or give its field a default"
            )
    try:
        return options(**{name: _value(name, hints[name], text) for name, text in texts.items()})
    except ValueError as error:
        raise UsageError(f"{model}: {error}; it takes: {describe(options)}") from error


def _value(name: str, hint: Any, text: str) -> Any:
    accepted = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    if types.NoneType in accepted and text.lower() in ("none", ""):
        return None
    convert = next(each for each in accepted if each is not types.NoneType)
    try:
        value = _BOOLEANS[text.lower()] if convert is bool else convert(text)
        if convert in (int, float) and not abs(value) < _LARGEST:
            raise ValueError("too large, or not a number")
        return value
    except (KeyError, ValueError) as error:
        expected = "true or false" if convert is bool else convert.__name__
        raise ValueError(f"option {name}={text} is not {expected}") from error


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
