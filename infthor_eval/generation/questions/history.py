"""What happened in a trajectory and what its frames show, read from the step log."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import ObjectInFrame, ObjectState, Step, iter_object_states
from infthor_eval.household.containment import logged_parent
from infthor_eval.household.wording import canonical_type

__all__ = ["DEFAULT_SHARE", "FRAME_PIXELS", "Event", "ObjectMove", "TrajectoryHistory", "is_same_object"]

_SIDE = 300
FRAME_PIXELS = _SIDE * _SIDE
_MARGIN = 15  # pixels between an object and the frame's edge from which on it is well inside
DEFAULT_SHARE = 0.001  # of the frame: 90 pixels, about a fork on a table an arm's length away


@dataclass(frozen=True)
class ObjectMove:
    """An object was picked up and put somewhere.

    Attributes:
        item: its id.
        object_type: its type.
        origin: id of what it was in or on; None where that is not clear.
        before: the frame before it was picked up.
        target: id of what it was put into or onto.
        after: the frame after it was put.
    """

    item: str
    object_type: str
    origin: str | None
    before: int
    target: str
    after: int


@dataclass(frozen=True)
class Event:
    """An action on an object that was carried out.

    Attributes:
        frame: the frame after it.
        action: its name.
        target: id of the object acted on.
        object_type: its type.
        receptacle: id of the receptacle, for PutObject.
    """

    frame: int
    action: str
    target: str
    object_type: str
    receptacle: str | None


class TrajectoryHistory:
    """The log of one trajectory, for question rules.

    Attributes:
        traj_id: the trajectory's folder.
        steps: the log.
        least: number of pixels from which on an object counts as shown.
    """

    def __init__(self, traj_id: str, steps: list[Step], share: float = DEFAULT_SHARE) -> None:
        """Read a log.

        Args:
            traj_id: the trajectory's folder.
            steps: the log, with the fields that a replay adds.
            share: of the frame's pixels that an object must fill to count as shown.

        Raises:
            DataError: the log is empty or lacks what questions are made from.
        """
        if not steps or any(step.seen is None for step in steps):
            raise DataError(f"{traj_id}: the log does not say what the frames show; replay the trajectory again")
        self.traj_id = traj_id
        self.steps = steps
        self.least = share * FRAME_PIXELS
        self._worlds = list(_snapshots(steps))

    def __len__(self) -> int:
        return len(self.steps)

    def world(self, frame: int) -> dict[str, ObjectState]:
        """The true state of every object at a frame, by id."""
        return self._worlds[frame]

    def seen(self, frame: int) -> dict[str, ObjectInFrame]:
        """What a frame shows, by id."""
        return self.steps[frame].seen or {}

    def shows(self, frame: int, *ids: str) -> bool:
        """Whether a frame shows all these objects large enough."""
        seen = self.seen(frame)
        return all(key in seen and seen[key].pixels >= self.least for key in ids)

    def clearness(self, frame: int, *ids: str) -> tuple[bool, int]:
        """How well a frame shows some of the objects that it shows: well inside it at best, then large."""
        seen = [self.seen(frame)[key] for key in ids]
        inside = all(_MARGIN <= edge < _SIDE - _MARGIN for item in seen for edge in item.box)
        return inside, min((item.pixels for item in seen), default=0)

    def clearest(self, frames: Iterable[int], *ids: str) -> int | None:
        """Of the frames that show all these objects the one that does so best, the earliest of equals."""
        shown = [frame for frame in frames if self.shows(frame, *ids)]
        return max(shown, key=lambda frame: self.clearness(frame, *ids), default=None)

    def shows_put(self, move: ObjectMove) -> bool:
        """Whether the frame after a move shows the object where it was put."""
        shown = self.shows(move.after, move.item, move.target)
        return shown and self.parent(move.after, move.item) == move.target

    def shows_slices(self, frame: int, whole: str) -> bool:
        """Whether a frame shows a slice of an object."""
        world = self.world(frame)
        slices = (key for key in world if key.startswith(f"{whole}|") and world[key].type.endswith("Sliced"))
        return any(self.shows(frame, key) for key in slices)

    def parent(self, frame: int, item: str) -> str | None:
        """What an object is directly in or on at a frame; None where it is held, lies on the floor, or it is not
        clear."""
        world = self.world(frame)
        return logged_parent(world[item], world) if item in world else None

    @cached_property
    def all_object_types(self) -> frozenset[str]:
        """The types that exist at any time."""
        return frozenset(canonical_type(state.type) for step in self.steps for state in step.changes.values())

    @cached_property
    def has_rooms(self) -> bool:
        """Whether the scene is of several rooms, each of which has a floor of its own."""
        return sum(state.type == "Floor" for state in self.world(0).values()) > 1

    @cached_property
    def types_told(self) -> frozenset[str]:
        """The types that the simulator calls visible at any time, so that the log tells what they are."""
        return frozenset(name for step in self.steps for name in step.object_log.visible)

    @cached_property
    def types_picked_up(self) -> frozenset[str]:
        """Those of them that can be picked up."""
        return frozenset(name for step in self.steps for name in step.object_log.pickupable)

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The actions on objects that were carried out, in order."""
        return tuple(
            Event(frame, step.action.partition(" ")[0], step.target, self._type_of(frame, step.target), step.receptacle)
            for frame, step in enumerate(self.steps)
            if step.success and step.action is not None and step.target is not None
        )

    @cached_property
    def moves(self) -> tuple[ObjectMove, ...]:
        """Every time that an object was picked up and put down, in order."""
        found: list[ObjectMove] = []
        picked: dict[str, int] = {}
        for event in self.events:
            if event.action == "PickupObject":
                picked[event.target] = event.frame - 1
            elif event.action == "PutObject" and event.receptacle is not None and event.target in picked:
                before = picked.pop(event.target)
                origin = self.parent(before, event.target)
                found.append(ObjectMove(event.target, event.object_type, origin, before, event.receptacle, event.frame))
        return tuple(found)

    def moves_of(self, item: str) -> tuple[ObjectMove, ...]:
        """The moves of one object."""
        return tuple(move for move in self.moves if move.item == item)

    @cached_property
    def pickups(self) -> Counter[str]:
        """How often each object was picked up, by id."""
        return Counter(event.target for event in self.events if event.action == "PickupObject")

    @cached_property
    def handled(self) -> dict[str, set[str]]:
        """The objects that were picked up, by type."""
        found: dict[str, set[str]] = {}
        for event in self.events:
            if event.action == "PickupObject":
                found.setdefault(event.object_type, set()).add(event.target)
        return found

    def alone(self, frame: int, item: str) -> bool:
        """Whether a frame shows no other object that people would call the same, however small."""
        object_type = canonical_type(self._type_of(frame, item))
        world = self.world(frame)
        others = (key for key in self.seen(frame) if key != item and key in world)
        return not any(
            canonical_type(world[key].type) == object_type and not is_same_object(key, item) for key in others
        )

    def only_one(self, frame: int, item: str) -> bool:
        """Whether the scene has no other object that people would call the same."""
        world = self.world(frame)
        object_type = canonical_type(world[item].type)
        return not any(
            canonical_type(state.type) == object_type and not is_same_object(key, item) for key, state in world.items()
        )

    def contents(self, frame: int, receptacle: str) -> frozenset[str]:
        """The objects directly in or on a receptacle."""
        return frozenset(key for key in self.world(frame) if self.is_inside(frame, key, receptacle))

    def is_inside(self, frame: int, item: str, receptacle: str) -> bool:
        """Whether an object is directly in or on a receptacle; a sink and its basin are one to people."""
        parent = self.parent(frame, item)
        return parent is not None and is_same_object(parent, receptacle)

    def shows_inside(self, frame: int, item: str) -> bool:
        """Whether a frame shows an object and what it is directly in or on."""
        parent = self.parent(frame, item)
        return parent is not None and self.shows(frame, item, parent)

    def _type_of(self, frame: int, item: str) -> str:
        """The type of an object; one that the action used up was there the frame before."""
        state = self.world(frame).get(item) or self.world(frame - 1)[item]
        return state.type


def is_same_object(one: str, other: str) -> bool:
    """Whether two ids mean one thing, or one of them a part of the other, as a basin is of its sink."""
    return one == other or one.startswith(f"{other}|") or other.startswith(f"{one}|")


def _snapshots(steps: list[Step]) -> Iterator[dict[str, ObjectState]]:
    """The worlds of a log; equal neighbours share one dict."""
    last: dict[str, ObjectState] = {}
    for step, world in zip(steps, iter_object_states(steps), strict=True):
        if step.changes or not last:
            last = {key: state for key, state in world.items() if state.exists}
        yield last
