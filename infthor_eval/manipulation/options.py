"""Options of the suite of manipulation on the command line, beside its task files."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from infthor_eval.episodes.options import SimulatorOptions
from infthor_eval.manipulation.kinds import Closing, Hand, PutCriterion, Senses, Stand
from infthor_eval.settings import Setting

# Settings of task files that are options too; one that is not given is the task's own.
Radius = Annotated[
    float,
    Meta(ge=0.04, le=0.5),  # as AI2-THOR allows
    Setting(
        help="Radius of the hand's sphere, metres; AI2-THOR's own is 0.06, the published one 0.5.",
        of="metres",
        metavar="R,...",
        each=True,
    ),
]
StandName = Annotated[
    str,
    Setting(
        help="Where the agent stands at the start: the expert's place, or that before the "
        "way to it.",
        choices=tuple(Stand),
    ),
]
HandName = Annotated[
    str,
    Setting(
        help="Height of the arm at the start of a pick-up.",
        choices=tuple(Hand),
    ),
]
ClosingName = Annotated[
    str,
    Setting(
        help="When a policy's hand closes in a pick-up: when it says so, with each step, or "
        "once at the end.",
        choices=tuple(Closing),
    ),
]
PutCriterionName = Annotated[
    str,
    Setting(
        help="When a put succeeds: once the object is released, wherever, or if it lies "
        "still in or on its receptacle.",
        choices=tuple(PutCriterion),
    ),
]
Instruction = Annotated[
    str,
    Setting(
        help='Instruction of a policy: words with {object} and {receptacle}, or "short".',
        metavar="TEXT",
    ),
]


Cameras = Annotated[
    str,
    Setting(
        help="Cameras that a policy with episodes sees by: the agent's, and one at the wrist.",
        choices=("front", "front,wrist"),
    ),
]


@dataclass(frozen=True, kw_only=True)
class ManipulationOptions(SimulatorOptions):
    """Options of a run; None is the task's own."""

    radius: Radius | None = None
    stand: StandName | None = None
    hand: HandName | None = None
    closing: ClosingName | None = None
    put_criterion: PutCriterionName | None = None
    instruction: Instruction | None = None
    cameras: Cameras = "front"
    state: Annotated[
        bool, Setting(help="Tell a policy with episodes where its hand is, and what it holds.")
    ] = False

    @property
    def senses(self) -> Senses:
        """What a policy is told beside its view."""
        return Senses(wrist="wrist" in self.cameras, state=self.state)
