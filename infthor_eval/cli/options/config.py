"""`--config`: the options of a command from a file; options on the command line override it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from infthor_eval.cli.options.values import PATH, ModelArgs
from infthor_eval.errors import UsageError, unknown_name


def _read_file(context: click.Context, _: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    from infthor_eval.runs.stored.command import read_options

    take_options(context, read_options(path), str(path))


def take_options(context: click.Context, given: Mapping[str, Any], source: str) -> None:
    """Have a command take options by their long names as if they were typed; what is typed wins.

    Args:
        context: context of the command, before its arguments are parsed.
        given: the options; several values are a list, those of `model_args` a mapping.
        source: where they are from, for messages.
    """
    params = (param for param in context.command.params if param.expose_value)
    known = {_long_name(param): param for param in params}
    values = {}
    for name, value in given.items():
        if name not in known:
            raise UsageError(f"{source}: {unknown_name('option', name, known)}")
        typed = _as_typed(source, name, value, known[name])
        if typed is not None:
            _check(source, name, typed, known[name], context)
            values[str(known[name].name)] = typed
    context.default_map = values


config_option = click.option(
    "--config",
    type=PATH,
    is_eager=True,  # before the options whose defaults it changes
    expose_value=False,
    callback=_read_file,
    metavar="FILE.yaml",
    help="Take options from a file, such as `run.yaml` in a run's folder; the command line "
    "overrides it.",
)


def comes_from_file(name: str) -> bool:
    """Return whether the value of an option of the present command is that of `--config`."""
    return click.get_current_context().get_parameter_source(name) is ParameterSource.DEFAULT_MAP


def _long_name(option: click.Parameter) -> str:
    """The name of an option in files."""
    long = next(name for name in option.opts if name.startswith("--"))
    return long.removeprefix("--").replace("-", "_")


def _as_typed(source: str, name: str, value: Any, option: click.Parameter) -> Any:
    """A value of a file as it would be typed; None for no value."""
    if value is None or (isinstance(option, click.Option) and option.is_flag):
        if not isinstance(value, bool | str | None):
            raise UsageError(f"{source}: {name} is {value!r:.60}; it is true or false")
        return value
    if isinstance(value, Mapping) and isinstance(option.type, ModelArgs):
        return {str(key): _text(source, f"{name}: {key}", one) for key, one in value.items()}
    is_list = isinstance(value, list | tuple)
    if option.multiple:
        return [_text(source, name, one) for one in (value if is_list else [value])]
    if is_list:
        return ",".join(_text(source, name, one) for one in value)
    return _text(source, name, value)


def _text(source: str, name: str, value: Any) -> str:
    if value is None or isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float | Path):
        return str(value)
    raise UsageError(f"{source}: {name} is {value!r:.60}; write one value, or a list of them")


def _check(
    source: str, name: str, value: Any, option: click.Parameter, context: click.Context
) -> None:
    """Refuse a wrong value here, where the message can name the file."""
    try:
        for one in value if option.multiple else (value,):
            option.type.convert(one, option, context)
    except click.UsageError as error:
        raise UsageError(f"{source}: {name}: {error.message}") from error
