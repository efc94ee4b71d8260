"""Types of arguments, and the words in which Unity's messages about wrong ones print them."""

import inspect
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any


class Vector3(dict[str, float]):
    """A position (metres) or rotation (degrees): `{"x", "y", "z"}`, any of them absent."""


_SCALARS = {int: "int", float: "float", str: "String", bool: "Boolean", Vector3: "Vector3"}


def type_name(annotation: Any) -> str:
    """Return Unity's name of a type; an optional type is called as its value."""
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        return type_name(next(option for option in inner if option is not types.NoneType))
    if origin is list:
        return f"{type_name(inner[0])}[]"
    return _SCALARS.get(annotation, "Object")


def unknown_arguments_text(
    name: str, unknown: Sequence[str], parameters: Mapping[str, inspect.Parameter], passed: Any
) -> str:
    """Return Unity's message about unknown arguments, with those that the action takes."""
    plural = "s" if len(unknown) > 1 else ""
    expected = ", ".join(_parameter_text(parameter) for parameter in parameters.values())
    return (
        f'\n\tAction: "{name}" called with invalid argument{plural}: {_quote(unknown)}'
        f"\n\tExpected arguments: {expected}\n\tYour arguments: {_quote(passed)}"
    )


def _parameter_text(parameter: inspect.Parameter) -> str:
    text = f"{type_name(parameter.annotation)} {parameter.name}"
    if parameter.default is inspect.Parameter.empty:
        return text
    return f"{text} = {'' if parameter.default is None else parameter.default}"


def _quote(names: Any) -> str:
    return ", ".join(f"'{name}'" for name in names)
