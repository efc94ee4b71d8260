"""`--config`: the options of a command from a file; options on the command line override it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from infthor_eval.cli.options.values import PATH, ModelArgs
from infthor_eval.errors import UsageError, unknown_name


def _read_file(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    from infthor_eval.runs.stored.command import read_options

    params = (param for param in context.command.params if param is not option)
    known = {_long_name(param): param for param in params}
    context.default_map = {}
    for name, value in read_options(path).items():
        if name not in known:
            raise UsageError(f"{path}: {unknown_name('option', name, known)}")
        typed = _as_typed(path, name, value, known[name])
        if typed is not None:
            _check(path, name, typed, known[name], context)
            context.default_map[str(known[name].name)] = typed


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


def _as_typed(path: Path, name: str, value: Any, option: click.Parameter) -> Any:
    """A value of a file as it would be typed; None for no value."""
    if value is None or (isinstance(option, click.Option) and option.is_flag):
        if not isinstance(value, bool | str | None):
            raise UsageError(f"{path}: {name} is {value!r:.60}; it is true or false")
        return value
    if isinstance(value, Mapping) and isinstance(option.type, ModelArgs):
        return {str(key): _text(path, f"{name}: {key}", one) for key, one in value.items()}
    if option.multiple:
        return [_text(path, name, one) for one in (value if isinstance(value, list) else [value])]
    if isinstance(value, list):
        return ",".join(_text(path, name, one) for one in value)
    return _text(path, name, value)


def _text(path: Path, name: str, value: Any) -> str:
    if value is None or isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return str(value)
    raise UsageError(f"{path}: {name} is {value!r:.60}; write one value, or a list of them")


def _check(
    path: Path, name: str, value: Any, option: click.Parameter, context: click.Context
) -> None:
    """Refuse a wrong value here, where the message can name the file."""
    try:
        for one in value if option.multiple else (value,):
            option.type.convert(one, option, context)
    except click.UsageError as error:
        raise UsageError(f"{path}: {name}: {error.message}") from error
