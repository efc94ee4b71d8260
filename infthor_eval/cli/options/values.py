"""What several commands share: options, and how their values are written."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import click

__all__ = [
    "FiniteRange",
    "ModelOptions",
    "ModelsAsked",
    "Whole",
    "floor_plans_option",
    "include_option",
    "model_options_in",
    "names_in",
    "pairs_in",
]

_LARGEST = 2**63 - 1  # of the numbers that a run's identity can hold

floor_plans_option = click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with recorded floor plans (thor_scenes/, alfred/layouts/), for scenes among them.",
)

include_option = click.option(
    "--include-path",
    "include",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    multiple=True,
    help="Folder with task files of your own; may be repeated.",
)


class Whole(click.ParamType):
    """A whole number that a run's identity can hold. An `IntRange` would print that limit into every help text.

    Args:
        least: that it may be.
    """

    name = "integer"

    def __init__(self, least: int = -_LARGEST) -> None:
        self._least = least

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """See `click.ParamType`."""
        number = int(click.INT.convert(value, param, ctx))
        if number < self._least:
            self.fail(f"{number} is less than {self._least}.", param, ctx)
        if number > _LARGEST:
            self.fail(f"{number} is more than {_LARGEST}.", param, ctx)
        return number


class FiniteRange(click.FloatRange):
    """A number within a range; not the "nan" that is neither below nor above anything."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """See `click.FloatRange`."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a number.", param, ctx)
        return number


class ModelOptions(click.ParamType):
    """Options of a model: `k=v,k=v`, or a mapping where a file gives them."""

    name = "K=V,..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dict[str, str]:
        """See `click.ParamType`."""
        return dict(value) if isinstance(value, Mapping) else model_options_in(value)


class ModelsAsked(click.ParamType):
    """Models by name, each with options of its own where it has any: `A:k=v,k=v,B`."""

    name = "MODEL[:K=V,...],..."

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, dict[str, str]]:
        """See `click.ParamType`."""
        return value if isinstance(value, dict) else _models_in(value, param.opts[0] if param else "--model")


def _models_in(text: str, option: str) -> dict[str, dict[str, str]]:
    found: dict[str, list[str]] = {}
    model = ""
    for item in filter(None, (part.strip() for part in text.split(","))):
        before, equals, _ = item.partition("=")
        named, _, _ = before.rpartition(":")  # a name may hold a colon, of a key none is known that does
        model = named or model if equals else item
        if not model:
            raise click.UsageError(f"{option}: {item!r} stands before any model; write MODEL:{item}")
        found.setdefault(model, []).extend([item.removeprefix(f"{named}:")] if equals else [])
    if not found:
        raise click.UsageError(f"{option} is empty; give a name")
    return {model: pairs_in(items, f"{option} {model}") for model, items in found.items()}


def names_in(text: str, option: str) -> tuple[str, ...]:
    """Names written with commas, each once.

    Raises:
        click.UsageError: there is none.
    """
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise click.UsageError(f"{option} is empty; give a name")
    return names


def model_options_in(text: str) -> dict[str, str]:
    """Options of a model written as lm-eval writes them: `k=v,k=v`.

    Raises:
        click.UsageError: an item is of another form, or a key stands twice.
    """
    return pairs_in(text.split(","), "--model-args")


def pairs_in(items: Iterable[str], where: str) -> dict[str, str]:
    """Keys and values written as `k=v`.

    Args:
        items: as typed.
        where: they were typed, for the message.

    Raises:
        click.UsageError: an item is of another form, or a key stands twice.
    """
    options: dict[str, str] = {}
    for item in filter(None, (part.strip() for part in items)):
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise click.UsageError(f"{where}: {item!r} is not of the form key=value")
        if key.strip() in options:
            raise click.UsageError(f"{where}: {key.strip()!r} is given twice")
        options[key.strip()] = value.strip()
    return options
