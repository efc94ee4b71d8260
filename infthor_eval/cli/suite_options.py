"""Options of suites on the command line, made from their dataclasses."""

import typing
from collections.abc import Callable, Mapping
from dataclasses import fields
from itertools import product
from types import NoneType
from typing import Any

import click

from infthor_eval.cli.options import LARGEST, names_in
from infthor_eval.errors import UsageError
from infthor_eval.suites import options_of, suite_names

__all__ = ["chosen_options", "suite_options"]


def suite_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add every suite's options to a command; a value that is not given is None."""
    for suite in reversed(suite_names()):
        hints = typing.get_type_hints(options_of(suite))
        for item in reversed(fields(options_of(suite))):
            choices = item.metadata.get("choices")
            command = click.option(
                f"--{item.name.replace('_', '-')}",
                type=click.Choice(choices) if choices else _click_type(hints[item.name]),
                metavar=item.metadata.get("metavar"),
                help=f"{item.metadata['help']} [{suite}]",
            )(command)
    return command


def chosen_options(suite: str, given: Mapping[str, Any], asked: typing.Collection[str]) -> list[Any]:
    """The options of one suite, of all that a command was given: for each run that they ask for.

    An option with `each` in its metadata takes several values with commas, and a run is asked for with each.

    Args:
        suite: the suite.
        given: option names to values, of all suites; None where not given.
        asked: the suites that are asked.

    Raises:
        UsageError: an option belongs to a suite that is not asked.
    """
    for other in suite_names():
        unused = [item.name for item in fields(options_of(other)) if given.get(item.name) is not None]
        if unused and other not in asked:
            raise UsageError(f"--{unused[0].replace('_', '-')} is for tasks of {other}; none of them is asked")
    known = typing.get_type_hints(options_of(suite))
    values: dict[str, list[Any]] = {}
    for item in fields(options_of(suite)):
        if given.get(item.name) is not None:
            typed = names_in(given[item.name], f"--{item.name}") if item.metadata.get("each") else [given[item.name]]
            values[item.name] = [_type(known[item.name])(value) for value in typed]
    return [options_of(suite)(**dict(zip(values, chosen, strict=True))) for chosen in product(*values.values())]


def _click_type(hint: Any) -> Any:
    return click.IntRange(-LARGEST, LARGEST) if _type(hint) is int else _type(hint)


def _type(hint: Any) -> type:
    """The type behind `int | None`."""
    return next(kept for kept in (typing.get_args(hint) or (hint,)) if kept is not NoneType)
