"""The options of `replay --timeline`, which writes folders for the published website."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from infthor_eval.generation.replay_set import ReplayForm

# AI2-THOR 5.0.0's rendering qualities, best last.
QUALITIES = (
    "Very Low",
    "Low",
    "Medium",
    "MediumCloseFitShadows",
    "High",
    "High WebGL",
    "Very High",
    "Ultra",
)
_PUBLISHED_QUALITY = "MediumCloseFitShadows"


def rendering_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command, which passes them to `parse_form`."""
    size = click.IntRange(1, 8192)
    for option in (
        click.option(
            "--keep-going",
            is_flag=True,
            help="With --timeline: go on after a refused action, instead of ending there.",
        ),
        click.option(
            "--jpeg-quality",
            type=click.IntRange(1, 100),
            help="With --timeline: quality of the pictures' files.  [default: 88]",
        ),
        click.option(
            "--quality",
            type=click.Choice(QUALITIES),
            metavar="NAME",
            help=f"With --timeline --unity: rendering quality: {', '.join(QUALITIES)}.  "
            f"[default: {_PUBLISHED_QUALITY}]",
        ),
        click.option(
            "--height", type=size, help="With --timeline: pixels of a picture.  [default: 640]"
        ),
        click.option(
            "--width", type=size, help="With --timeline: pixels of a picture.  [default: 640]"
        ),
        click.option(
            "--smooth",
            type=click.IntRange(1),
            help="With --timeline: pictures of a move or look; a turn has twice as many.  "
            "[default: 1]",
        ),
        click.option(
            "--timeline",
            is_flag=True,
            help="Write what the published renderer writes for the authors' website, in a folder "
            "for each trajectory: frames/000000.jpg and so on, and timeline.json.",
        ),
    ):
        command = option(command)
    return command


def parse_form(
    *, timeline: bool, frames: int, unity: bool, keep_going: bool, **rendering: Any
) -> ReplayForm:
    """Return the form that the options give; without --timeline that of a set.

    Raises:
        UsageError: an option is not for this form.
    """
    from infthor_eval.errors import UsageError
    from infthor_eval.generation.rendering import RenderSettings
    from infthor_eval.generation.replay import SetForm

    given = {name: value for name, value in rendering.items() if value is not None}
    if not timeline:
        names = [f"--{name.replace('_', '-')}" for name in (*given, *["keep_going"] * keep_going)]
        if names:
            raise UsageError(f"{names[0]}: is for --timeline; add it, or leave {names[0]} out")
        return SetForm(frames)
    if frames != 1:
        raise UsageError("--frames: is for sets; with --timeline give --smooth")
    if unity:
        given.setdefault("quality", _PUBLISHED_QUALITY)
    elif "quality" in given:
        raise UsageError("--quality: is Unity's; add --unity, or leave it out")
    return RenderSettings(**given, keep_going=keep_going)
