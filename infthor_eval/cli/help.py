"""Commands whose help begins with an example, and has their options by what they are for."""

from collections.abc import Callable
from typing import Any

import click


class SuiteOption(click.Option):
    """An option for tasks of some suites alone, named in its `suites`."""

    def __init__(self, *arguments: Any, suites: tuple[str, ...], **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self.suites = suites


class _WithExample(click.Command):
    def __init__(self, *arguments: Any, example: str, **settings: Any) -> None:
        """Create a command; the example is a command line as a user types it, or several lines."""
        super().__init__(*arguments, **settings)
        self.example = example

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Example"):
            for line in self.example.splitlines():
                # Not wrapped: it is to be copied.
                formatter.write(f"{'':{formatter.current_indent}}{line}\n")
        formatter.write_paragraph()
        super().format_help(ctx, formatter)


class ExampleCommand(_WithExample):
    """A command with an example."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, those of suites by suite."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for option in self.get_params(ctx):
            record = option.get_help_record(ctx)
            if record is not None:
                suites = option.suites if isinstance(option, SuiteOption) else ()
                title = f"Options of {' and '.join(suites)}" if suites else "Options"
                sections.setdefault(title, []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records)


class ExampleGroup(_WithExample, click.Group):
    """A group of commands with an example, each of which has one, too."""

    command_class = ExampleCommand


def example_command(name: str, example: str) -> Callable[[Callable[..., Any]], ExampleCommand]:
    """Return a decorator that makes a command whose help begins with an example."""
    return click.command(name, cls=ExampleCommand, example=example)
