"""Failures of earlier tasks in a room, not tried again while the objects involved are unchanged."""

from collections.abc import Iterator

from msgspec.structs import astuple

from infthor_eval.household.containment import direct_parent
from infthor_eval.household.symbolic import SymbolicRoom, room_of
from infthor_eval.thor.view import SimulatorView, ThorObject

_Size = tuple[float, ...]
# tasks after which a failure is forgotten: other objects have moved and may have cleared the way
_LIFETIME = 24
_NEAR = 0.02  # tolerance of positions and sizes, metres


class KnownFailures:
    """Objects that cannot be acted on, and receptacles without room for an object."""

    def __init__(self) -> None:
        self._n_tasks = 0
        # Number of the task at which an object failed, and its position then.
        self._blocked: dict[str, tuple[int, tuple[float, ...]]] = {}
        # Number of the task at which an object did not fit into a receptacle, and its contents
        # then.
        self._refused: dict[tuple[str, str], tuple[int, frozenset[str]]] = {}
        self._sizes: dict[str, _Size | None] = {}

    def __bool__(self) -> bool:
        return bool(self._blocked or self._refused)

    def note(self, view: SimulatorView, item: str, receptacle: str | None) -> None:
        """Record that an object cannot be acted on, or does not fit into a receptacle.

        Args:
            view: state before the failed task.
            item: id of the object.
            receptacle: id of the receptacle without room; None if the object itself cannot be acted
                on.
        """
        if receptacle is not None:
            self._refused[item, receptacle] = self._n_tasks, _contents(view, receptacle)
            if item in view.objects:
                self._sizes[item] = _size(view.objects[item])
        elif item in view.objects:
            self._blocked[item] = self._n_tasks, _position(view, item)

    def task_done(self) -> None:
        """Count a completed task, which changed the room."""
        self._n_tasks += 1

    def forget(self) -> None:
        """Forget all failures."""
        self._blocked.clear()
        self._refused.clear()

    def room(self, view: SimulatorView) -> SymbolicRoom:
        """Return the room, without the objects and pairs that are known to fail."""
        oldest = self._n_tasks - _LIFETIME
        self._blocked = {
            item: (since, position)
            for item, (since, position) in self._blocked.items()
            if since > oldest and item in view.objects and _is_near(position, _position(view, item))
        }
        # A receptacle from which something was taken may have room now.
        self._refused = {
            pair: (since, contents)
            for pair, (since, contents) in self._refused.items()
            if since > oldest and contents <= _contents(view, pair[1])
        }
        return room_of(view, self._blocked.keys(), set(self._without_room(view)))

    def _without_room(self, view: SimulatorView) -> Iterator[tuple[str, str]]:
        """Yield (object, receptacle) pairs that do not fit: known ones, and those by their sizes.

        An object does not fit where an object of at most its size did not, nor into a receptacle of
        a smaller base.
        """
        yield from self._refused
        all_sizes = {key: _size(thor_object) for key, thor_object in view.objects.items()}
        sizes = {key: size for key, size in all_sizes.items() if size is not None}
        items = [key for key in sizes if view.objects[key].pickupable]
        for item, receptacle in self._refused:
            refused_size = self._sizes.get(item)
            if refused_size is not None:
                yield from ((key, receptacle) for key in items if _covers(sizes[key], refused_size))
        for receptacle in (key for key in sizes if view.objects[key].receptacle):
            base = sizes[receptacle][:2]
            yield from ((key, receptacle) for key in items if not _covers(base, sizes[key][:2]))


def _size(item: ThorObject) -> _Size | None:
    """Return the horizontal sizes, the larger first, and the height, metres."""
    box = item.axis_aligned_bounding_box
    return None if box is None else (*sorted((box.size.x, box.size.z), reverse=True), box.size.y)


def _covers(one: _Size, other: _Size) -> bool:
    """Return True if one size is at least the other in each direction."""
    return all(a >= b - _NEAR for a, b in zip(one, other, strict=True))


def _position(view: SimulatorView, item: str) -> tuple[float, ...]:
    return astuple(view.objects[item].position)


def _is_near(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(abs(a - b) <= _NEAR for a, b in zip(one, other, strict=True))


def _contents(view: SimulatorView, receptacle: str) -> frozenset[str]:
    objects = view.objects
    return frozenset(
        key for key, item in objects.items() if direct_parent(item, objects) == receptacle
    )
