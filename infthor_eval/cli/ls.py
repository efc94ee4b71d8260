"""`infthor-eval ls`: what there is to evaluate, on what, and what was evaluated."""

from pathlib import Path

import click

from infthor_eval.cli.options import floor_plans_option, include_option

__all__ = ["command"]


@click.group("ls", invoke_without_command=True)
@click.pass_context
def command(context: click.Context) -> None:
    """List the models with their options, the tasks, the scenes, or the runs in a folder."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@command.command("models")
def _models() -> None:
    """Models and baselines, with their options and defaults."""
    from infthor_eval.cli.listing import models

    models()


@command.command("tasks")
@include_option
def _tasks(include: tuple[Path, ...]) -> None:
    """Tasks and groups of tasks."""
    from infthor_eval.cli.listing import tasks

    tasks(include)


@command.command("scenes")
@floor_plans_option
def _scenes(data: Path | None) -> None:
    """Scenes of the embedded simulator."""
    from infthor_eval.cli.listing import scenes

    scenes(data)


@command.command("runs")
@click.argument("folder", metavar="[DIR]", type=click.Path(path_type=Path), default=Path("results"))
def _runs(folder: Path) -> None:
    """Runs below DIR (results, if not given): units done, missing and failed, and each task's headline number."""
    from infthor_eval.cli.listing_runs import runs

    runs(folder)
