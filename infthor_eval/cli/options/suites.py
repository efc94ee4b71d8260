"""Options of suites on the command line, built from their dataclasses."""

import typing
from collections.abc import Callable, Collection, Mapping
from dataclasses import Field, fields
from itertools import product
from types import NoneType
from typing import Any

import click
import msgspec

from infthor_eval.cli.help import SuiteOption
from infthor_eval.cli.options.values import WholeNumber, split_names
from infthor_eval.errors import UsageError
from infthor_eval.suites import options_class, suite_names
from model_adapters.options.parsing import is_required


def suite_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of every suite to a command, which passes them to `suite_values`.

    Suites with an option of one name share it; its help has the text of each.
    """
    for name, by_suite in _shorthands().items():
        _, help_text = next(iter(by_suite.values())).metadata["shorthands"][name]
        command = click.option(
            f"--{name}",
            cls=SuiteOption,
            suites=tuple(by_suite),
            is_flag=True,
            default=None,
            help=help_text,
        )(command)
    for name, by_suite in reversed(_options_by_name().items()):
        first, option = next(iter(by_suite.items()))
        kind = _value_type(typing.get_type_hints(options_class(first))[name])
        choices = option.metadata.get("choices")
        types = {bool: None, int: WholeNumber()}
        command = click.option(
            f"--{name.replace('_', '-')}",
            cls=SuiteOption,
            suites=tuple(by_suite),
            type=click.Choice(choices) if choices else types.get(kind, kind),
            is_flag=kind is bool,
            default=None,
            metavar=option.metadata.get("metavar"),
            help=_help(by_suite),
        )(command)
    return command


def suite_values(params: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of all suites among the parameters of a command; None where not given."""
    # A suite that was installed after the command was imported has options that the command does
    # not know.
    return {name: params.get(name) for name in (*_options_by_name(), *_shorthands())}


def expand_suite_options(suite: str, params: Mapping[str, Any], used: Collection[str]) -> list[Any]:
    """Return the options of a suite for each of its runs.

    An option with `each` in its metadata takes several values with commas, and there is a run for
    each of them. A flag in its `shorthands` stands for such values.

    Args:
        suite: name of the suite.
        params: options of all suites by name; None where not given.
        used: names of the suites that the tasks belong to.

    Raises:
        UsageError: an option belongs to no suite that is used, or is missing and has no default, or
            a flag stands for one that is given as well.
    """
    _refuse_unused(params, used)
    kinds = typing.get_type_hints(options_class(suite))
    values: dict[str, list[Any]] = {}
    for option in fields(options_class(suite)):
        value = _value(option, params)
        if value is not None:
            typed = [value]
            if option.metadata.get("each"):
                typed = list(split_names(value, f"--{option.name}"))
            values[option.name] = [
                msgspec.convert(value, kinds[option.name], strict=False) for value in typed
            ]
        elif is_required(option):
            raise UsageError(
                f"--{option.name.replace('_', '-')}: {suite} needs it, as its field has no "
                "default; give it"
            )
    return [
        options_class(suite)(**dict(zip(values, chosen, strict=True)))
        for chosen in product(*values.values())
    ]


def refuse_duplicate_options(command: Callable[..., Any]) -> None:
    """Refuse options of another package's suite that the command, which has those of all suites,
    has already.

    Raises:
        UsageError: an option is there twice.
    """
    options: list[click.Parameter] = command.__click_params__  # type: ignore[attr-defined]
    names = [option.name for option in options]
    duplicates = sorted({str(name) for name in names if names.count(name) > 1})
    if duplicates:
        suite = next(iter(_options_by_name()[duplicates[0]]))
        raise UsageError(
            f"the option {duplicates[0]} of the suite {suite} is one of every run; give it another "
            "name"
        )


def _value(option: Field[Any], params: Mapping[str, Any]) -> Any:
    """Return what is given for an option, by itself or by a flag that stands for its values."""
    value = params.get(option.name)
    for name, (meant, _) in option.metadata.get("shorthands", {}).items():
        if params.get(name):
            if value is not None:
                raise UsageError(
                    f"--{name} and --{option.name}: the first is --{option.name} {meant}; give one "
                    "of them"
                )
            return meant
    return value


def _options_by_name() -> dict[str, dict[str, Field[Any]]]:
    """The options of all suites by name, then by suite."""
    options: dict[str, dict[str, Field[Any]]] = {}
    for suite in suite_names():
        for option in fields(options_class(suite)):
            options.setdefault(option.name, {})[suite] = option
    return options


def _shorthands() -> dict[str, dict[str, Field[Any]]]:
    """The options that have a flag for several of their values: by the flag, then by suite."""
    flags: dict[str, dict[str, Field[Any]]] = {}
    for by_suite in _options_by_name().values():
        for suite, option in by_suite.items():
            for flag in option.metadata.get("shorthands", {}):
                flags.setdefault(flag, {})[suite] = option
    return flags


def _refuse_unused(params: Mapping[str, Any], used: Collection[str]) -> None:
    for name, by_suite in (_options_by_name() | _shorthands()).items():
        if params.get(name) is not None and not set(by_suite) & set(used):
            raise UsageError(
                f"--{name.replace('_', '-')} is for tasks of {' and '.join(by_suite)}; --tasks "
                "names none of these"
            )


def _help(by_suite: Mapping[str, Field[Any]]) -> str:
    """The text of all suites, or those of each with its name."""
    suites: dict[str, list[str]] = {}
    for suite, option in by_suite.items():
        suites.setdefault(option.metadata.get("help", ""), []).append(suite)
    if len(suites) == 1:
        return next(iter(suites))
    return " ".join(f"{text} [{', '.join(names)}]" for text, names in suites.items())


def _value_type(hint: Any) -> type:
    """The type behind `int | None`."""
    return next(kept for kept in (typing.get_args(hint) or (hint,)) if kept is not NoneType)
