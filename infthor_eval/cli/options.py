"""Options that several commands take."""

from pathlib import Path

import click

__all__ = ["floor_plans_option"]

floor_plans_option = click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with recorded floor plans (thor_scenes/, alfred/layouts/), for scenes among them.",
)
