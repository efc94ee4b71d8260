"""Options that stand twice on a command line: click would take the last without a word."""

from collections.abc import Sequence

import click

__all__ = ["refuse_repeated"]


def refuse_repeated(context: click.Context, command: click.Command, arguments: Sequence[str]) -> None:
    """Refuse an option with one value that is given several.

    Args:
        context: of the group that the command belongs to.
        command: what is called; of a group, its own command counts.
        arguments: what follows its name.

    Raises:
        click.UsageError: an option stands twice.
    """
    if isinstance(command, click.Group):
        inner = command.get_command(context, arguments[0]) if arguments else None
        if inner is not None:
            refuse_repeated(context, inner, arguments[1:])
        return
    taking = {name: option for option in command.params if _takes_one(option) for name in option.opts}
    seen: set[str] = set()
    rest = iter(arguments)
    for argument in rest:
        name, equals, _ = argument.partition("=")
        if argument == "--":
            return
        if name not in taking:
            continue
        if name in seen:
            raise click.UsageError(f"{name} is given twice; give it once")
        seen.add(name)
        if not equals:
            next(rest, None)  # its value, which may look like an option


def _takes_one(option: click.Parameter) -> bool:
    return isinstance(option, click.Option) and not (option.multiple or option.is_flag or option.count)
