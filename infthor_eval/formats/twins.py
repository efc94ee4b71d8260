"""Pairs of twins: `twins.jsonl` of a set, a line a pair of worlds; and the twins of agents.

Both worlds of a set are trajectories like any other; their pictures are `shared_frames`. Twins of
agents are trajectories that say themselves which pair they are of (`TwinWorld`).
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from infthor_eval.errors import DataError
from infthor_eval.formats.question import Answer
from infthor_eval.formats.reading import read_bytes
from infthor_eval.storage.files import write_atomically

_TWINS = "twins.jsonl"
_HINT = "make the twins again"


class ComparedFrame(msgspec.Struct, array_like=True, frozen=True):
    """One frame of a pair.

    Attributes:
        same: True if the pictures are equal.
        changed: ids in the first world of what differs and is in view.
    """

    same: bool
    changed: tuple[str, ...] = ()


class PairedQuestion(msgspec.Struct, frozen=True, omit_defaults=True):
    """A question with another answer in each world; of a placebo, with the same in both.

    Attributes:
        text: the question.
        form: its form, with {} for names.
        question_type: its type.
        fact: what it is about; questions on one fact of a pair are not independent.
        answers: gold answers in each world.
        clues: frames with the evidence in either world, which are shown on both sides.
        own_clues: frames that each world's question has by itself; none where the rules do not ask
            it in that world.
        absence: True where the answer is that something is nowhere, for each world.
        overlap: strict score of each world's answer as a reply in the other.
        moment: frame after which it is asked; None for the end.
    """

    text: str
    form: str
    question_type: str
    fact: str
    answers: tuple[tuple[Answer, ...], tuple[Answer, ...]]
    clues: tuple[int, ...]
    own_clues: tuple[tuple[int, ...], tuple[int, ...]]
    absence: tuple[bool, bool]
    overlap: tuple[float, float]
    moment: int | None = None

    @property
    def is_placebo(self) -> bool:
        """True if its answer is the same in both worlds, whose frames differ all the same."""
        return self.answers[0] == self.answers[1]


class TwinPair(msgspec.Struct, frozen=True):
    """Two worlds and what differs between them.

    Attributes:
        id: id of the pair.
        kind: kind of the edit.
        seed: seed of all that was drawn.
        base: hash of the trajectory that the worlds were made of, which nobody is shown.
        traj_ids: names of the two trajectories, in drawn order.
        floor_plan: scene.
        ids: ids in the second world by those in the first, where they differ.
        changed: ids in the first world of what may differ.
        displaced: ids in the first world of third objects that lie a little beside, on the same
            receptacle, as what was changed was in the way.
        types: object types that the changed fact is about; # stands for a count of all objects.
        frames: how each frame compares.
        questions: the paired questions.
    """

    id: Annotated[str, Meta(pattern=r"^[\w.-]+$")]
    kind: str
    seed: int
    base: str
    traj_ids: tuple[str, str]
    floor_plan: str
    ids: dict[str, str]
    changed: tuple[str, ...]
    displaced: tuple[str, ...]
    types: tuple[str, ...]
    frames: tuple[ComparedFrame, ...]
    questions: tuple[PairedQuestion, ...]

    @property
    def tells_worlds(self) -> bool:
        """True if a question has another answer in each world."""
        return not all(question.is_placebo for question in self.questions)

    def evidence(self, moment: int | None) -> int | None:
        """Return the newest frame up to a moment, or to the end, that differs; None without any."""
        end = len(self.frames) if moment is None else moment + 1
        differing = (at for at, frame in enumerate(self.frames[:end]) if not frame.same)
        return max(differing, default=None)


class TwinPlace(msgspec.Struct, frozen=True):
    """Where the object of a final task lies: its receptacle, and its own x and z in metres."""

    receptacle: str = msgspec.field(name="receptacleObjectId")
    x: float
    z: float


class TwinWorld(msgspec.Struct, frozen=True):
    """One world of a pair whose final task needs an object that is elsewhere in the other.

    Attributes:
        pair: id of the pair.
        base: hash of the trajectory that the pair was made of; its pairs are one cluster.
        kind: kind of the edit.
        places: where the object is at the end of the history, in this world and in the other one.
    """

    pair: str
    base: str
    kind: str
    places: tuple[TwinPlace, TwinPlace]


class ArmChoice(msgspec.Struct, frozen=True):
    """What an arm is told at the end of a world, where it stands before two things.

    Attributes:
        pair: name of the pair of choices; the other one is in the twin world.
        base: hash of the trajectory whose rooms the worlds are in; its pairs are one cluster.
        instruction: the task in words.
        target: id of the thing that it names in this world, by what happened there.
        other: id of the other thing.
    """

    pair: str
    base: str
    instruction: str
    target: str
    other: str


def has_pairs(folder: Path) -> bool:
    """Return True if a set has a file of pairs of worlds."""
    return (folder / _TWINS).is_file()


def read_pairs(folder: Path) -> list[TwinPair]:
    """Read the pairs of a set."""
    path = folder / _TWINS
    pairs = []
    for number, line in enumerate(read_bytes(path, _HINT).splitlines(), 1):
        try:
            pairs.append(msgspec.json.decode(line, type=TwinPair))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise DataError(f"{path}:{number}: not a pair of twins ({error}); {_HINT}") from error
    return pairs


def write_pairs(folder: Path, pairs: Iterable[TwinPair]) -> None:
    """Write the pairs of a set, atomically."""
    with write_atomically(folder / _TWINS) as partial:
        partial.write_bytes(b"".join(msgspec.json.encode(pair) + b"\n" for pair in pairs))
