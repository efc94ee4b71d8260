"""Options of the suite of manipulation on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.episodes.options import SimulatorOptions
from infthor_eval.errors import UsageError
from infthor_eval.manipulation.kinds import Closing, Hand, PutCriterion, Stand

RADII = (0.04, 0.5)  # of the hand's sphere, metres, as AI2-THOR allows


@dataclass(frozen=True, kw_only=True)
class ManipulationOptions(SimulatorOptions):
    """Options of the suite, with their help texts; None is the task's own."""

    radius: str | None = field(
        default=None,
        metadata={
            "help": "Radius of the hand's magnet, metres, a run with each.",
            "metavar": "R,...",
            "each": True,
        },
    )
    stand: str | None = field(
        default=None,
        metadata={
            "choices": tuple(map(str, Stand)),
            "help": "Where the agent stands at the start: the expert's place, or that before the "
            "way to it.",
        },
    )
    hand: str | None = field(
        default=None,
        metadata={
            "choices": tuple(map(str, Hand)),
            "help": "Height of the arm at the start of a pick-up.",
        },
    )
    closing: str | None = field(
        default=None,
        metadata={
            "choices": tuple(map(str, Closing)),
            "help": "When a policy's hand closes in a pick-up: when it says so, with each step, or "
            "once at the end.",
        },
    )
    put_criterion: str | None = field(
        default=None,
        metadata={
            "choices": tuple(map(str, PutCriterion)),
            "help": "When a put succeeds: once the object is released, wherever, or if it lies "
            "still in or on its receptacle.",
        },
    )
    instruction: str | None = field(
        default=None,
        metadata={
            "help": 'Instruction of a policy: words with {object} and {receptacle}, or "short".',
            "metavar": "TEXT",
        },
    )

    def __post_init__(self) -> None:
        """Check the options; raises UsageError for unknown frames, or a radius out of range."""
        super().__post_init__()
        if self.radius_metres is not None and not RADII[0] <= self.radius_metres <= RADII[1]:
            raise UsageError(
                f"--radius {self.radius}: is a length of {RADII[0]} to {RADII[1]} metres"
            )

    @property
    def radius_metres(self) -> float | None:
        """The radius; None for the task's own."""
        try:
            return None if self.radius is None else float(self.radius)
        except ValueError:
            return 0.0  # no number, which is refused like one that is too small
