"""What the suite of manipulation can be told on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.errors import UsageError

__all__ = ["RADII", "ManipulationOptions"]

_FRAMES = ("shown", "blank")
RADII = (0.04, 0.5)  # of the hand's sphere, metres, as AI2-THOR allows


@dataclass(frozen=True, kw_only=True)
class ManipulationOptions:
    """Options of the suite; the help that people see stands with each.

    Attributes:
        simulator: "embedded", "unity" (the build that ai2thor downloads), or the path of a Unity executable.
        scenes: folder with recorded floor plans, for trajectories in them.
        radius: of the hand's sphere, metres, as typed; None takes the task's own.
        instruction: of a policy; None takes the task's own.
        frames: what is shown in the frames' places.
    """

    simulator: str = field(
        default="embedded",
        metadata={"help": "embedded, unity, or the path of a Unity executable.", "metavar": "NAME"},
    )
    scenes: str | None = field(
        default=None,
        metadata={"help": "Folder with recorded floor plans (thor_scenes/).", "metavar": "DIR", "is_place": True},
    )
    radius: str | None = field(
        default=None,
        metadata={"help": "Radius of the hand's magnet, metres, a run with each.", "metavar": "R,...", "each": True},
    )
    instruction: str | None = field(
        default=None,
        metadata={
            "help": 'What a policy is told: words with {object} and {receptacle}, or "short".',
            "metavar": "TEXT",
        },
    )
    frames: str = field(
        default="shown",
        metadata={"help": "Show what in the frames' places, a run with each.", "metavar": "HOW,...", "each": True},
    )

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            UsageError: unknown stand-ins for frames, or no radius.
        """
        if self.frames not in _FRAMES:
            raise UsageError(f"--frames {self.frames}: tasks of manipulation have {', '.join(_FRAMES)}")
        if self.radius is not None:
            self._metres()

    @property
    def radius_metres(self) -> float | None:
        """The radius; None where the task's own is meant."""
        return None if self.radius is None else self._metres()

    def _metres(self) -> float:
        try:
            metres = float(str(self.radius))
        except ValueError:
            metres = 0.0
        if not RADII[0] <= metres <= RADII[1]:
            raise UsageError(f"--radius {self.radius}: is a length of {RADII[0]} to {RADII[1]} metres")
        return metres
