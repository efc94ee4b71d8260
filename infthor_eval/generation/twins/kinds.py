"""The kinds of edits by name, and what a kind is.

To add a kind of twins: a class with the members of `EditKind`, and its name in `KINDS` here; in
another package, an entry point of the group `infthor_eval.twins`.
"""

import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol, TypeVar

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.plugins import PluginTable
from infthor_eval.thor.simulator import Simulator

T = TypeVar("T")
_HERE = "infthor_eval.generation.twins"
KINDS = PluginTable(
    "kind of twins",
    "infthor_eval.twins",
    {
        # These go on from states of the episode that are stored until a start is restored.
        "count-open": f"{_HERE}.openings:CountOpen",
        "count-move": f"{_HERE}.carrying:CountMove",
        "count-put": f"{_HERE}.carrying:CountPut",
        "put-target": f"{_HERE}.carrying:PutTarget",
        # These restore another start.
        "swap": f"{_HERE}.exchanges:Swap",
        "swap-task": f"{_HERE}.exchanges:SwapTask",
        "swap-sliced": f"{_HERE}.exchanges:SwapSliced",
        "move": f"{_HERE}.exchanges:Move",
        "replace": f"{_HERE}.start_states:Replace",
        "state": f"{_HERE}.start_states:Opened",
    },
    "docs/twins.md",
)


class EditRefused(Exception):
    """An edit that the scene or the simulator does not allow; the message is the reason."""


@dataclass(frozen=True)
class Worlds:
    """Two worlds of an episode that differ in one thing.

    Attributes:
        pair: the trajectories; scenes, ids and words are those of each world.
        ids: ids in the second world by those in the first, for objects whose ids differ.
        changed: ids in the first world of the objects that may differ, with their slices.
        types: object types that the changed fact is about; only questions on them are paired.
        inserted: indices of the actions that the episode does not have, in each world.
        has_own: true if one of the worlds is the episode's own.
    """

    pair: tuple[Trajectory, Trajectory]
    changed: frozenset[str]
    types: frozenset[str]
    ids: dict[str, str] = field(default_factory=dict)
    inserted: range = range(0)
    has_own: bool = False

    @property
    def changed_in_second(self) -> frozenset[str]:
        """The ids of the changed objects in the second world."""
        return frozenset(self.ids.get(key, key) for key in self.changed)

    def flipped(self) -> "Worlds":
        """Return the same worlds in the other order."""
        first, second = self.pair
        back = {new: old for old, new in self.ids.items()}
        return replace(self, pair=(second, first), changed=self.changed_in_second, ids=back)


class Proposal(Protocol):
    """An edit of an episode that may be possible."""

    @property
    def keys(self) -> frozenset[str]:
        """Ids in the episode of the objects that may differ."""

    @property
    def index(self) -> int:
        """Frame from which on they may; 0 for the start."""

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """Return the two worlds.

        Raises:
            EditRefused: the edit is not possible.
            SimulatorError: the simulator fails.
        """


class EditKind(Protocol):
    """A kind of edits.

    Attributes:
        name: its name in the table of kinds.
    """

    name: ClassVar[str]

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Proposal]:
        """Yield edits of an episode that may be possible, in random order."""


def varied(edits: Iterable[T], keys_of: Callable[[T], set[str]]) -> list[T]:
    """Return edits with those first of which no object is in an earlier one, so that facts vary.

    Args:
        edits: the edits.
        keys_of: returns the ids of the objects of one.
    """
    first: list[T] = []
    later: list[T] = []
    used: set[str] = set()
    for edit in edits:
        keys = keys_of(edit)
        (later if keys & used else first).append(edit)
        used |= keys
    return [*first, *later]
