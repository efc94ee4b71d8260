"""Options of suites on the command line, built from their settings."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING
from itertools import product
from typing import Any

import click
import msgspec

from infthor_eval.cli.help import SuiteOption
from infthor_eval.cli.options.values import WholeNumber, split_names
from infthor_eval.errors import UsageError
from infthor_eval.settings import Declared, Shorthand, settings_of
from infthor_eval.suites import options_class, suite_names


def suite_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of every suite to a command, which passes them to `suite_values`.

    Suites with an option of one name share it; its help has the text of each.
    """
    for name, flags in _shorthands().items():
        command = click.option(
            f"--{name}",
            cls=SuiteOption,
            suites=tuple(flags),
            is_flag=True,
            default=None,
            help=next(iter(flags.values())).help,
        )(command)
    for name, by_suite in reversed(_options_by_name().items()):
        option = next(iter(by_suite.values()))
        kind, setting = option.kind, option.setting
        choices = () if setting.each else tuple(map(str, setting.choices))
        types = {bool: None, int: WholeNumber()} if not setting.each else {kind: str}
        command = click.option(
            f"--{name.replace('_', '-')}",
            cls=SuiteOption,
            suites=tuple(by_suite),
            type=click.Choice(choices) if choices else types.get(kind, kind),
            is_flag=kind is bool,
            default=None,
            metavar=setting.metavar,
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

    An option with `each` takes several values with commas, and there is a run for each of them. A
    flag in its `shorthands` stands for such values.

    Args:
        suite: name of the suite.
        params: options of all suites by name; None where not given.
        used: names of the suites that the tasks belong to.

    Raises:
        UsageError: an option belongs to no suite that is used, or is missing and has no default, or
            a flag stands for one that is given as well.
    """
    _refuse_unused(params, used)
    values: dict[str, list[Any]] = {}
    for name, option in settings_of(options_class(suite)).items():
        value = _value(name, option, params)
        if value is not None:
            typed = split_names(value, f"--{name}") if option.setting.each else (value,)
            values[name] = [_convert(name, option, value) for value in typed]
        elif option.default is MISSING:
            raise UsageError(
                f"--{name.replace('_', '-')}: {suite} needs it, as its field has no "
                "default; give it"
            )
    return [
        options_class(suite)(**dict(zip(values, chosen, strict=True)))
        for chosen in product(*values.values())
    ]


def _convert(name: str, option: Declared, text: Any) -> Any:
    try:
        return msgspec.convert(text, option.kind, strict=False)
    except msgspec.ValidationError as error:
        raise UsageError(f"--{name.replace('_', '-')} {text}: give {option.valid}") from error


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


def _value(name: str, option: Declared, params: Mapping[str, Any]) -> Any:
    """Return what is given for an option, by itself or by a flag that stands for its values."""
    value = params.get(name)
    for flag in option.setting.shorthands:
        if params.get(flag.name):
            if value is not None:
                raise UsageError(
                    f"--{flag.name} and --{name}: the first is --{name} {flag.values}; give one of "
                    "them"
                )
            return flag.values
    return value


def _options_by_name() -> dict[str, dict[str, Declared]]:
    """The options of all suites by name, then by suite."""
    options: dict[str, dict[str, Declared]] = {}
    for suite in suite_names():
        for name, option in settings_of(options_class(suite)).items():
            options.setdefault(name, {})[suite] = option
    return options


def _shorthands() -> dict[str, dict[str, Shorthand]]:
    """The flags for several values of an option: by name, then by suite."""
    flags: dict[str, dict[str, Shorthand]] = {}
    for by_suite in _options_by_name().values():
        for suite, option in by_suite.items():
            for flag in option.setting.shorthands:
                flags.setdefault(flag.name, {})[suite] = flag
    return flags


def _refuse_unused(params: Mapping[str, Any], used: Collection[str]) -> None:
    every: dict[str, Mapping[str, Any]] = {**_options_by_name(), **_shorthands()}
    for name, by_suite in every.items():
        if params.get(name) is not None and not set(by_suite) & set(used):
            raise UsageError(
                f"--{name.replace('_', '-')} is for tasks of {' and '.join(by_suite)}; --tasks "
                "names none of these"
            )


def _help(by_suite: Mapping[str, Declared]) -> str:
    """The text of all suites, or those of each with its name."""
    suites: dict[str, list[str]] = {}
    for suite, option in by_suite.items():
        suites.setdefault(option.setting.help, []).append(suite)
    if len(suites) == 1:
        return next(iter(suites))
    return " ".join(f"{text} [{', '.join(names)}]" for text, names in suites.items())
