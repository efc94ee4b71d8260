"""Options of suites on the command line, made from their dataclasses."""

import typing
from collections.abc import Callable, Mapping
from dataclasses import Field, fields
from itertools import product
from types import NoneType
from typing import Any

import click

from infthor_eval.cli.options.values import Whole, names_in
from infthor_eval.errors import UsageError
from infthor_eval.suites import options_of, suite_names

__all__ = ["chosen_options", "refuse_twins", "suite_options"]


def suite_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add every suite's options to a command; a value that is not given is None.

    Suites share an option of one name, each with what it says of it.
    """
    found: dict[str, dict[str, Field[Any]]] = {}
    for suite in suite_names():
        for item in fields(options_of(suite)):
            found.setdefault(item.name, {})[suite] = item
    for name, by_suite in reversed(found.items()):
        first, item = next(iter(by_suite.items()))
        kind = _type(typing.get_type_hints(options_of(first))[name])
        choices = item.metadata.get("choices")
        command = click.option(
            f"--{name.replace('_', '-')}",
            type=None if kind is bool else click.Choice(choices) if choices else _click_type(kind),
            is_flag=kind is bool,
            default=None,
            metavar=item.metadata.get("metavar"),
            help=_help(by_suite),
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
    _refuse_unasked(given, asked)
    known = typing.get_type_hints(options_of(suite))
    values: dict[str, list[Any]] = {}
    for item in fields(options_of(suite)):
        if given.get(item.name) is not None:
            typed = names_in(given[item.name], f"--{item.name}") if item.metadata.get("each") else [given[item.name]]
            values[item.name] = [_type(known[item.name])(value) for value in typed]
    return [options_of(suite)(**dict(zip(values, chosen, strict=True))) for chosen in product(*values.values())]


def refuse_twins(command: Callable[..., Any]) -> None:
    """Refuse options of another package's suite that are a command's own.

    Args:
        command: with its own options and those of all suites.

    Raises:
        UsageError: names the option.
    """
    made: list[click.Parameter] = command.__click_params__  # type: ignore[attr-defined]
    names = [option.name for option in made]
    twins = sorted({str(name) for name in names if names.count(name) > 1})
    if twins:
        having = [suite for suite in suite_names() if twins[0] in {item.name for item in fields(options_of(suite))}]
        raise UsageError(f"the option {twins[0]} of the suite {having[0]} is one of every run; give it another name")


def _refuse_unasked(given: Mapping[str, Any], asked: typing.Collection[str]) -> None:
    suites = suite_names()
    for name, value in given.items():
        having = [suite for suite in suites if name in {item.name for item in fields(options_of(suite))}]
        if value is not None and having and not set(having) & set(asked):
            raise UsageError(
                f"--{name.replace('_', '-')} is for tasks of {' and '.join(having)}; none of them is asked"
            )


def _help(by_suite: Mapping[str, Field[Any]]) -> str:
    """What each suite says of its option, and whose it is; what several say alike, once."""
    saying: dict[str, list[str]] = {}
    for suite, item in by_suite.items():
        saying.setdefault(item.metadata.get("help", ""), []).append(suite)
    return " ".join(f"{said} [{', '.join(suites)}]" for said, suites in saying.items())


def _click_type(kind: type) -> Any:
    return Whole() if kind is int else kind


def _type(hint: Any) -> type:
    """The type behind `int | None`."""
    return next(kept for kept in (typing.get_args(hint) or (hint,)) if kept is not NoneType)
