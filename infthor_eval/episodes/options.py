"""Options of suites that act in a simulator."""

from dataclasses import dataclass, field

from infthor_eval.errors import UsageError

_FRAMES = ("shown", "blank")


@dataclass(frozen=True, kw_only=True)
class SimulatorOptions:
    """Options that the suites share, with their help texts."""

    simulator: str = field(
        default="embedded",
        metadata={"help": "embedded, unity, or the path of a Unity executable.", "metavar": "NAME"},
    )
    scenes: str | None = field(
        default=None,
        metadata={
            "help": "Folder with recorded floor plans (thor_scenes/).",
            "metavar": "DIR",
            "is_place": True,
        },
    )
    frames: str = field(
        default="shown",
        metadata={
            "help": "Frames to show, a run with each: shown, blank.",
            "metavar": "HOW,...",
            "each": True,
        },
    )

    def __post_init__(self) -> None:
        """Check the options; raises UsageError for an unknown kind of frames."""
        if self.frames not in _FRAMES:
            raise UsageError(
                f"--frames {self.frames}: tasks in a simulator have {', '.join(_FRAMES)}"
            )
