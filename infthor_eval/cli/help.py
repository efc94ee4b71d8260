"""Commands whose help begins with an example."""

from typing import Any

import click

__all__ = ["ExampleCommand", "ExampleGroup"]


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


class ExampleGroup(_WithExample, click.Group):
    """A group of commands with an example."""
