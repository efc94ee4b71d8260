"""The events of a trajectory and the contents of its frames, read from the step log."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import ObjectInFrame, ObjectState, Step, iter_object_states
from infthor_eval.grouping import grouped
from infthor_eval.household.containment import logged_parent
from infthor_eval.household.wording import canonical_type

_SIDE = 300
_MARGIN = 15  # distance from the frame's edge from which on an object is well inside, pixels
DEFAULT_SHARE = 0.001  # of the frame: 90 pixels, about a spoon on a table at 1.5 m
SHARE_FACTOR = {"Fork": 2.0, "Spoon": 2.0}
"""Times the share that an object of a type must fill, where that of others is not enough.

Measured by naming random views blind (benchmarks/drawings.md): at 0.1 % of the frame and at 0.15 %
some forks and spoons were taken for each other, at 0.2 % none of 40. All other types were named
right at 0.1 %, but for views in which something hides their telling parts.
"""
_LEAST_INSIDE = 0.25  # of an object at the frame's edge: less is a sliver that may be anything
_LEAST_TELLING = 0.5  # of what tells whether it is open
_LIDS = frozenset({"Box", "Laptop", "Toilet"})  # which their tops tell; others, all of them


@dataclass(frozen=True)
class ObjectMove:
    """A pick-up of an object, and the next put of it.

    Attributes:
        item: id of the object.
        object_type: type of the object.
        origin: id of the receptacle it was in or on; None if that is ambiguous.
        before: frame before the pick-up.
        target: id of the receptacle it was put into or onto.
        after: frame after the put.
    """

    item: str
    object_type: str
    origin: str | None
    before: int
    target: str
    after: int


@dataclass(frozen=True)
class Event:
    """A successful action on an object.

    Attributes:
        frame: frame after the action.
        action: name of the action.
        target: id of the object acted on.
        object_type: type of the object.
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
        traj_id: name of the trajectory's folder.
        steps: the log.
        share: share of the frame that an object must fill to count as shown.
        min_pixels: minimum size of an object that counts as shown, pixels: `share` of the frame;
            more by `SHARE_FACTOR` for some types.
    """

    def __init__(self, traj_id: str, steps: list[Step], share: float = DEFAULT_SHARE) -> None:
        """Read a log with the fields that a replay adds."""
        if not steps or any(step.seen is None for step in steps):
            raise DataError(
                f"{traj_id}: the log does not say what the frames show; replay the trajectory again"
            )
        self.traj_id = traj_id
        self.steps = steps
        self.share = share
        self.min_pixels = share * _SIDE**2
        self._states = list(_snapshots(steps))
        self._parents = list(_parents(self._states))
        self._grouped: dict[int, dict[str, list[str]]] = {}  # by map of parents
        self._contents: dict[tuple[int, str], frozenset[str]] = {}  # likewise
        self._shown: dict[int, dict[str, tuple[bool, int]]] = {}  # by frame

    def until(self, moment: int) -> "TrajectoryHistory":
        """Return what has happened by a frame; what is known of single frames is shared."""
        end = moment + 1
        part = TrajectoryHistory(self.traj_id, self.steps[:1], self.share)
        part.steps = self.steps[:end]
        part._states = self._states[:end]
        part._parents = self._parents[:end]
        part._grouped = self._grouped
        part._contents = self._contents
        part._shown = self._shown
        return part

    def __len__(self) -> int:
        return len(self.steps)

    def states(self, frame: int) -> dict[str, ObjectState]:
        """Return the true states of all objects at a frame, by id."""
        return self._states[frame]

    def objects_in_frame(self, frame: int) -> dict[str, ObjectInFrame]:
        """Return the objects in a frame, by id."""
        return self.steps[frame].seen or {}

    def shows(self, frame: int, *ids: str) -> bool:
        """Return True if a frame shows all these objects large enough, and not by a sliver."""
        return self.shown_in(frame).keys() >= set(ids)

    def shown_in(self, frame: int) -> Mapping[str, tuple[bool, int]]:
        """Return how well a frame shows each object that it shows so (`clarity`), by id."""
        if frame not in self._shown:
            self._shown[frame] = {
                key: self.clarity(frame, key)
                for key, seen in self.objects_in_frame(frame).items()
                if seen.inside >= _LEAST_INSIDE
                and seen.pixels >= self.min_pixels * SHARE_FACTOR.get(key.partition("|")[0], 1.0)
            }
        return self._shown[frame]

    def shows_whether_open(self, frame: int, item: str) -> bool:
        """Return True if a frame shows an object, and of it what tells whether it is open."""
        if not self.shows(frame, item):
            return False
        shown = self.objects_in_frame(frame)[item]
        telling = shown.top_inside if item.partition("|")[0] in _LIDS else shown.inside
        return telling >= _LEAST_TELLING

    def shows_apart(self, frame: int, one: str, other: str) -> bool:
        """Return True if a frame shows both objects, and their boxes there do not touch."""
        if not self.shows(frame, one, other):
            return False
        seen = self.objects_in_frame(frame)
        left, top, right, bottom = seen[one].box
        x_min, y_min, x_max, y_max = seen[other].box
        return right + 1 < x_min or x_max + 1 < left or bottom + 1 < y_min or y_max + 1 < top

    def clarity(self, frame: int, *ids: str) -> tuple[bool, int]:
        """Return how well a frame shows objects: whether all are well inside, the least size."""
        seen = [self.objects_in_frame(frame)[key] for key in ids]
        edges = [edge for shown in seen for edge in shown.box]
        inside = all(_MARGIN <= edge < _SIDE - _MARGIN for edge in edges)
        return inside, min((shown.pixels for shown in seen), default=0)

    def clearest(self, frames: Iterable[int], *ids: str) -> int | None:
        """Return the frame that shows all these objects best, the earliest of equals, or None."""
        shown = [frame for frame in frames if self.shows(frame, *ids)]
        return max(shown, key=lambda frame: self.clarity(frame, *ids), default=None)

    def shows_put(self, move: ObjectMove) -> bool:
        """Return True if the frame after a move shows the object where it was put, told apart."""
        return self._shows_end(move) and self.is_alone_in_frame(move.after, move.item)

    def _shows_end(self, move: ObjectMove) -> bool:
        shown = self.shows(move.after, move.item, move.target)
        return shown and self.parent(move.after, move.item) == move.target

    def put_clues(self, move: ObjectMove) -> tuple[int, int] | None:
        """Return the two frames that show a put, or None if they do not.

        After a put other loose things lie there, too: only the object in the hand, in the frame
        before, tells which was put.
        """
        before = move.after - 1
        is_shown = self.shows(before, move.item) and self._shows_end(move)
        return (before, move.after) if is_shown else None

    def opening_clues(self, event: Event) -> tuple[int, int] | None:
        """Return the two frames that show an opening, closed and open, or None if they do not."""
        before = event.frame - 1
        shown = all(self.shows_whether_open(f, event.target) for f in (before, event.frame))
        return (before, event.frame) if shown else None

    def shows_slices(self, frame: int, whole: str) -> bool:
        """Return True if a frame shows a slice of an object."""
        states = self.states(frame)
        slices = (
            key
            for key in states
            if key.startswith(f"{whole}|") and states[key].type.endswith("Sliced")
        )
        return any(self.shows(frame, key) for key in slices)

    def parent(self, frame: int, item: str) -> str | None:
        """Return what an object is directly in or on; None if held, on the floor, or ambiguous."""
        return self._parents[frame].get(item)

    @cached_property
    def all_object_types(self) -> frozenset[str]:
        """Types of all objects that ever exist."""
        return frozenset(
            canonical_type(state.type) for step in self.steps for state in step.changes.values()
        )

    @cached_property
    def types_in_frames(self) -> frozenset[str]:
        """Types of all objects that a frame shows, however small."""
        shown = (
            (self.states(frame), key)
            for frame in range(len(self))
            for key in self.objects_in_frame(frame)
        )
        return frozenset(canonical_type(states[key].type) for states, key in shown if key in states)

    @cached_property
    def seen(self) -> frozenset[str]:
        """Ids of the objects that a frame shows large enough."""
        return frozenset[str]().union(*map(self.shown_in, range(len(self))))

    @cached_property
    def best_frames(self) -> dict[str, int]:
        """By type, in order, the frame that shows an object of it best, the earliest of equals."""
        best: dict[str, tuple[tuple[bool, int], int]] = {}
        for frame in range(len(self)):
            states = self.states(frame)
            for key, clarity in self.shown_in(frame).items():
                if key in states:
                    sighting = clarity, -frame
                    best[states[key].type] = max(sighting, best.get(states[key].type, sighting))
        return {object_type: -negated for object_type, (_, negated) in sorted(best.items())}

    @cached_property
    def has_rooms(self) -> bool:
        """True if the scene has several rooms; each has a floor object."""
        return sum(state.type == "Floor" for state in self.states(0).values()) > 1

    @cached_property
    def reported_types(self) -> frozenset[str]:
        """Types that are ever reported as visible, so it is known if they can be picked up."""
        return frozenset(name for step in self.steps for name in step.object_log.visible)

    @cached_property
    def pickupable_types(self) -> frozenset[str]:
        """Types that the log reports as objects that can be picked up."""
        return frozenset(name for step in self.steps for name in step.object_log.pickupable)

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """Successful actions on objects, in order."""
        return tuple(
            Event(
                frame,
                step.action.partition(" ")[0],
                step.target,
                self._type_of(frame, step.target),
                step.receptacle,
            )
            for frame, step in enumerate(self.steps)
            if step.success and step.action is not None and step.target is not None
        )

    @cached_property
    def moves(self) -> tuple[ObjectMove, ...]:
        """All pick-ups that were followed by a put, in order of the puts."""
        moves: list[ObjectMove] = []
        picked: dict[str, int] = {}
        for event in self.events:
            if event.action == "PickupObject":
                picked[event.target] = event.frame - 1
            elif (
                event.action == "PutObject"
                and event.receptacle is not None
                and event.target in picked
            ):
                before = picked.pop(event.target)
                origin = self.parent(before, event.target)
                moves.append(
                    ObjectMove(
                        event.target,
                        event.object_type,
                        origin,
                        before,
                        event.receptacle,
                        event.frame,
                    )
                )
        return tuple(moves)

    def moves_of(self, item: str) -> tuple[ObjectMove, ...]:
        """Return the moves of one object."""
        return tuple(move for move in self.moves if move.item == item)

    def target_type(self, move: ObjectMove) -> str:
        """Return the type of what an object was put into or onto."""
        return self.states(move.after)[move.target].type

    @cached_property
    def pickups(self) -> Counter[str]:
        """Number of pick-ups of each object, by id."""
        return Counter(event.target for event in self.events if event.action == "PickupObject")

    @cached_property
    def picked_up_by_type(self) -> dict[str, set[str]]:
        """Ids of the objects that were picked up, by type."""
        by_type: dict[str, set[str]] = {}
        for event in self.events:
            if event.action == "PickupObject":
                by_type.setdefault(event.object_type, set()).add(event.target)
        return by_type

    def is_alone_in_frame(self, frame: int, item: str) -> bool:
        """Return True if a frame shows no other object with the same name, not even a small one."""
        object_type = canonical_type(self._type_of(frame, item))
        states = self.states(frame)
        others = (key for key in self.objects_in_frame(frame) if key != item and key in states)
        return not any(
            canonical_type(states[key].type) == object_type and not is_same_object(key, item)
            for key in others
        )

    def is_only_one(self, frame: int, item: str) -> bool:
        """Return True if the scene has no other object with the same name."""
        states = self.states(frame)
        object_type = canonical_type(states[item].type)
        return not any(
            canonical_type(state.type) == object_type and not is_same_object(key, item)
            for key, state in states.items()
        )

    def contents(self, frame: int, receptacle: str) -> frozenset[str]:
        """Return the ids of the objects directly in or on a receptacle."""
        parents = self._parents[frame]
        known = id(parents), receptacle
        if known not in self._contents:
            inside = self._inside(parents)
            same = (parent for parent in inside if is_same_object(parent, receptacle))
            self._contents[known] = frozenset(chain.from_iterable(inside[it] for it in same))
        return self._contents[known]

    def _inside(self, parents: Mapping[str, str | None]) -> dict[str, list[str]]:
        """Return what is directly in or on each parent."""
        if id(parents) not in self._grouped:
            placed = ((parent, key) for key, parent in parents.items() if parent is not None)
            self._grouped[id(parents)] = grouped(placed)
        return self._grouped[id(parents)]

    def is_inside(self, frame: int, item: str, receptacle: str) -> bool:
        """Return True if an object is directly in or on a receptacle (or a basin's sink)."""
        parent = self.parent(frame, item)
        return parent is not None and is_same_object(parent, receptacle)

    def shows_inside(self, frame: int, item: str) -> bool:
        """Return True if a frame shows an object and what it is directly in or on."""
        parent = self.parent(frame, item)
        return parent is not None and self.shows(frame, item, parent)

    def _type_of(self, frame: int, item: str) -> str:
        """Return the type of an object, by the frame before if the action consumed it."""
        return (self.states(frame).get(item) or self.states(frame - 1)[item]).type


def is_same_object(one: str, other: str) -> bool:
    """Return True if two ids are equal, or one is a part of the other, as a basin of its sink."""
    return one == other or one.startswith(f"{other}|") or other.startswith(f"{one}|")


def _snapshots(steps: list[Step]) -> Iterator[dict[str, ObjectState]]:
    """Yield the states at each step; steps without a change share one dict, to save memory."""
    last: dict[str, ObjectState] = {}
    for step, states in zip(steps, iter_object_states(steps), strict=True):
        if step.changes or not last:
            last = {key: state for key, state in states.items() if state.exists}
        yield last


def _parents(snapshots: Iterable[Mapping[str, ObjectState]]) -> Iterator[dict[str, str | None]]:
    """Yield what each object is directly in or on; snapshots between which nothing is put down,
    taken or gone share one map."""
    told: dict[str, tuple[tuple[str, ...], bool]] | None = None
    parents: dict[str, str | None] = {}
    for states in snapshots:
        tells = {key: (state.parents, state.held) for key, state in states.items()}
        if tells != told:
            told = tells
            parents = {key: logged_parent(state, states) for key, state in states.items()}
        yield parents
