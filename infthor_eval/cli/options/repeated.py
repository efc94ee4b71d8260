"""Options that appear twice on a command line: click would take the last one without a word."""

from collections.abc import Sequence

import click


def refuse_repeated_options(
    context: click.Context, command: click.Command, arguments: Sequence[str]
) -> None:
    """Refuse an option with one value that is given twice.

    Args:
        context: context of the group that the command belongs to.
        command: the command; for a group, its own command is checked.
        arguments: arguments after the command's name.

    Raises:
        click.UsageError: an option is given twice.
    """
    if isinstance(command, click.Group):
        inner = command.get_command(context, arguments[0]) if arguments else None
        if inner is not None:
            refuse_repeated_options(context, inner, arguments[1:])
        return
    options = filter(_takes_one_value, command.params)
    with_one_value = {name: option for option in options for name in option.opts}
    seen: set[str] = set()
    rest = iter(arguments)
    for argument in rest:
        name, equals, _ = argument.partition("=")
        if argument == "--":
            return
        if name not in with_one_value:
            continue
        if name in seen:
            is_list = ",..." in str(with_one_value[name].make_metavar(context))
            several = ", with commas between several values" if is_list else ""
            raise click.UsageError(f"{name} is given twice; give it once{several}")
        seen.add(name)
        if not equals:
            next(rest, None)  # its value, which may look like an option


def _takes_one_value(option: click.Parameter) -> bool:
    return isinstance(option, click.Option) and not (
        option.multiple or option.is_flag or option.count
    )
