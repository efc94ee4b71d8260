"""`--config`: the options of a command out of a file; what is typed beside it wins."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from infthor_eval.cli.options.values import ModelOptions
from infthor_eval.errors import UsageError, unknown_name

__all__ = ["comes_from_file", "config_option"]


def _read(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    """Make what the file says the defaults of the command."""
    if path is None:
        return
    from infthor_eval.runs.configuration import read_options

    known = {_long_name(item): item for item in context.command.params if item is not option}
    context.default_map = {}
    for name, value in read_options(path).items():
        if name not in known:
            raise UsageError(f"{path}: {unknown_name('option', name, known)}")
        typed = _as_typed(path, name, value, known[name])
        if typed is not None:
            _try(path, name, typed, known[name], context)
            context.default_map[str(known[name].name)] = typed


config_option = click.option(
    "--config",
    type=click.Path(path_type=Path),
    is_eager=True,  # before the options whose defaults it changes
    expose_value=False,
    callback=_read,
    metavar="FILE.yaml",
    help="Take the options from a file, as `run.yaml` in a run's folder; what is typed beside it wins.",
)


def comes_from_file(name: str) -> bool:
    """Whether the value of this option of the present command is that of `--config`."""
    return click.get_current_context().get_parameter_source(name) is ParameterSource.DEFAULT_MAP


def _long_name(option: click.Parameter) -> str:
    """As it is written in files."""
    return next(name for name in option.opts if name.startswith("--")).removeprefix("--").replace("-", "_")


def _as_typed(path: Path, name: str, value: Any, option: click.Parameter) -> Any:
    """What a value of a file would be on a command line; None where it is none."""
    if value is None or (isinstance(option, click.Option) and option.is_flag):
        return value
    if isinstance(value, Mapping) and isinstance(option.type, ModelOptions):
        return {str(key): _text(path, f"{name}: {key}", item) for key, item in value.items()}
    if option.multiple:
        return [_text(path, name, item) for item in (value if isinstance(value, list) else [value])]
    if isinstance(value, list):
        return ",".join(_text(path, name, item) for item in value)
    return _text(path, name, value)


def _text(path: Path, name: str, value: Any) -> str:
    if value is None or isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return str(value)
    raise UsageError(f"{path}: {name} is {value!r:.60}; write one value, or a list of them")


def _try(path: Path, name: str, value: Any, option: click.Parameter, context: click.Context) -> None:
    """Refuse a value here, where it is known that the file has it."""
    try:
        for one in value if option.multiple else (value,):
            option.type.convert(one, option, context)
    except click.UsageError as error:
        raise UsageError(f"{path}: {name}: {error.message}") from error
