"""Functions of a user's own file: what they take, and what else of it can be set.

The first parameters say what a function is, by their names; those that follow have defaults and are
options, as those of a class are.
"""

import dataclasses
import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.own_file import name_in_file

_TYPES: dict[str, type] = {kind.__name__: kind for kind in (str, int, float, bool)}
_BY_PLACE = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


@dataclass(frozen=True)
class OwnFunction:
    """A function of a user's file.

    Attributes:
        name: FILE.py:NAME, as the user gave it.
        call: the function.
        takes: names of its first parameters, which say what it is.
        options: a frozen dataclass with its further parameters and their defaults.
    """

    name: str
    call: Callable[..., Any]
    takes: tuple[str, ...]
    options: type


def read_function(
    name: str, function: Callable[..., Any], forms: Iterable[tuple[str, ...]]
) -> OwnFunction:
    """Return what a function is, by the names of its parameters.

    Args:
        name: FILE.py:NAME, as the user gave it.
        function: the function.
        forms: names of the first parameters of all functions that could be meant.
    """
    signature = inspect.signature(function)
    parameters = list(signature.parameters.values())
    required = tuple(one.name for one in parameters if one.default is one.empty)
    others = parameters[len(required) :]
    in_order = required == tuple(one.name for one in parameters[: len(required)])
    plain = all(one.kind in _BY_PLACE for one in parameters[: len(required)])
    forms = tuple(forms)
    if required not in forms or not in_order or not plain:
        short = name_in_file(name)
        known = " or ".join(f"{short}({', '.join(form)})" for form in forms)
        raise ModelError(
            f"{name} takes {signature}; write {known}, and further parameters with defaults"
        )
    fields = [
        (one.name, _type_of(name, one), dataclasses.field(default=one.default)) for one in others
    ]
    return OwnFunction(
        name, function, required, dataclasses.make_dataclass("Options", fields, frozen=True)
    )


def _type_of(name: str, parameter: inspect.Parameter) -> Any:
    """Return the type of an option: that of its annotation if it is a simple one, else that of its
    default."""
    annotation = parameter.annotation
    known = _TYPES.get(annotation if isinstance(annotation, str) else _name_of(annotation))
    if known is not None:
        return known
    if parameter.default is None:
        return str | None
    if type(parameter.default) in _TYPES.values():
        return type(parameter.default)
    raise ModelError(
        f"{name}: the default of {parameter.name} is {parameter.default!r:.60}; make it a text, a "
        "number, True, False or None"
    )


def _name_of(annotation: Any) -> str:
    return getattr(annotation, "__name__", "")
