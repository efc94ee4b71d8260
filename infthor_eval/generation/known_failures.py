"""What turned out not to work in a room, so that it is not tried again while things are as they were."""

from collections.abc import Iterator

from infthor_eval.household.containment import direct_parent
from infthor_eval.household.symbolic import SymbolicRoom, room_of
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["KnownFailures"]

_Size = tuple[float, ...]
_BELIEVED = 8  # tasks that a setback is believed for: other things move too and may clear the way
_NEAR = 0.02  # metres within which an object has not moved


class KnownFailures:
    """Objects out of reach, and receptacles without room for an object."""

    def __init__(self) -> None:
        self._tasks = 0
        self._blocked: dict[str, tuple[int, tuple[float, float, float]]] = {}
        self._refused: dict[tuple[str, str], tuple[int, frozenset[str]]] = {}
        self._sizes: dict[str, _Size | None] = {}

    def __bool__(self) -> bool:
        return bool(self._blocked or self._refused)

    def note(self, view: SimulatorView, item: str, receptacle: str | None) -> None:
        """Remember that an object cannot be acted on, or finds no room in a receptacle, as things are.

        Args:
            view: as things are.
            item: the object.
            receptacle: where it was to go; None where the object itself is out of reach.
        """
        if receptacle is not None:
            self._refused[item, receptacle] = self._tasks, _contents(view, receptacle)
            if item in view.objects:
                self._sizes[item] = _size(view.objects[item])
        elif item in view.objects:
            self._blocked[item] = self._tasks, _position(view, item)

    def task_done(self) -> None:
        """One more task changed the room."""
        self._tasks += 1

    def forget(self) -> None:
        """Believes that everything may work again."""
        self._blocked.clear()
        self._refused.clear()

    def room(self, view: SimulatorView) -> SymbolicRoom:
        """The room without what is not believed to work."""
        oldest = self._tasks - _BELIEVED
        self._blocked = {
            item: (since, position)
            for item, (since, position) in self._blocked.items()
            if since > oldest and item in view.objects and _is_near(position, _position(view, item))
        }
        # A receptacle that has lost something may have room now.
        self._refused = {
            pair: (since, contents)
            for pair, (since, contents) in self._refused.items()
            if since > oldest and contents <= _contents(view, pair[1])
        }
        return room_of(view, self._blocked.keys(), set(self._without_room(view)))

    def _without_room(self, view: SimulatorView) -> Iterator[tuple[str, str]]:
        """Where things find no room: as was found, and where they are larger than what did not, or than the place."""
        yield from self._refused
        sizes = {key: size for key, item in view.objects.items() if (size := _size(item)) is not None}
        things = [key for key in sizes if view.objects[key].pickupable]
        for item, receptacle in self._refused:
            least = self._sizes.get(item)
            yield from ((key, receptacle) for key in things if least is not None and _covers(sizes[key], least))
        for place in (key for key in sizes if view.objects[key].receptacle):
            ground = sizes[place][:2]
            yield from ((key, place) for key in things if not _covers(ground, sizes[key][:2]))


def _size(item: ThorObject) -> _Size | None:
    """Width, depth (the larger first) and height, metres."""
    box = item.axis_aligned_bounding_box
    return None if box is None else (*sorted((box.size.x, box.size.z), reverse=True), box.size.y)


def _covers(one: _Size, other: _Size) -> bool:
    """Whether one thing is as large as the other, in each direction."""
    return all(a >= b - _NEAR for a, b in zip(one, other, strict=True))


def _position(view: SimulatorView, item: str) -> tuple[float, float, float]:
    at = view.objects[item].position
    return at.x, at.y, at.z


def _is_near(one: tuple[float, float, float], other: tuple[float, float, float]) -> bool:
    return all(abs(a - b) <= _NEAR for a, b in zip(one, other, strict=True))


def _contents(view: SimulatorView, receptacle: str) -> frozenset[str]:
    objects = view.objects
    return frozenset(key for key, item in objects.items() if direct_parent(item, objects) == receptacle)
