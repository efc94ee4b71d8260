"""Options of suites that act in a simulator."""

from dataclasses import dataclass
from typing import Annotated

from infthor_eval.settings import Setting, check_options


@dataclass(frozen=True, kw_only=True)
class SimulatorOptions:
    """Options that the suites share."""

    simulator: Annotated[
        str,
        Setting(help="embedded, unity, or the path of a Unity executable.", metavar="NAME"),
    ] = "embedded"
    scenes: Annotated[
        str | None,
        Setting(
            help="Folder with recorded floor plans (thor_scenes/).",
            metavar="DIR",
            is_place=True,
        ),
    ] = None
    frames: Annotated[
        str,
        Setting(
            help="Frames to show, a run with each: shown, blank.",
            choices=("shown", "blank"),
            metavar="HOW,...",
            each=True,
        ),
    ] = "shown"

    def __post_init__(self) -> None:
        """Raise UsageError if a value is not valid."""
        check_options(self)
