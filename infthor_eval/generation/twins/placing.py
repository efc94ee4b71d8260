"""Giving objects each other's places in a restored scene, and the scene that results."""

import math
from collections.abc import Mapping, Sequence
from itertools import product

import msgspec
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import ObjectPose, Scene
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.generation.twins.tolerance import tolerance_of
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import NO_RENDERING, Simulator
from infthor_eval.thor.view import Box, SimulatorView, ThorObject, Vector

_Offset = tuple[float, float]

# Places beside the other's that are tried, nearest first, metres.
_STEPS = [step / 20 for step in range(-5, 6)]
_OFFSETS = sorted(product(_STEPS, _STEPS), key=lambda offset: math.hypot(*offset))
_SLACK = 0.01  # how far the new object may reach beyond a container, metres
_WIDER = 0.15  # how much wider it may be elsewhere, metres
_FAR = 50.0  # metres above the room, where objects wait for their new places


def scenes_of_both(
    scene: Scene,
    simulator: Simulator,
    places: Sequence[tuple[ThorObject, tuple[ThorObject, ThorObject]]],
) -> tuple[Scene, Scene]:
    """Stand one of two objects at each of some places, the other one in a second world.

    Both stand at the same point, so that no distance tells which of them a room was generated with:
    where only one of them has room, both are moved aside. What a world has no place for is above
    the room, at the same height in both.

    Args:
        scene: the scene, which is restored first.
        simulator: a simulator.
        places: for each place the object that is there in the scene, and that of either world.

    Returns:
        The two scenes, as trajectories have them.

    Raises:
        EditRefused: there is no room, or a third object moved or is elsewhere.
        SimulatorError: the simulator fails.
    """
    items = {obj.object_id: obj for where, both in places for obj in (where, *both)}
    mover = _Mover(scene, simulator, items)
    offsets = [mover.offset_for_both(where, both) for where, both in places]
    worlds = []
    for side in (0, 1):
        standing = [
            (both[side], where, offset)
            for (where, both), offset in zip(places, offsets, strict=True)
        ]
        worlds.append(mover.scene(standing))
    return worlds[0], worlds[1]


class _Mover:
    """Stands objects of a restored scene at the places of others.

    Args:
        scene: the scene.
        simulator: a simulator.
        items: the objects that are moved, by id.
    """

    def __init__(self, scene: Scene, simulator: Simulator, items: Mapping[str, ThorObject]) -> None:
        self._scene = scene
        self._simulator = simulator
        self._items = items
        self._waiting = {key: _above(number) for number, key in enumerate(items)}
        restore(simulator, scene)
        self._before = simulator.view.objects
        self._clear()

    def _clear(self) -> None:
        """Take all that is moved out of the way."""
        for item in self._items.values():
            self._take_away(item)

    def _take_away(self, item: ThorObject) -> None:
        """Take an object out of the way, in the rotation that it has."""
        _lift(self._simulator, item, self._waiting[item.object_id])

    def offset_for_both(self, where: ThorObject, both: tuple[ThorObject, ThorObject]) -> _Offset:
        """Return how far from an object's place, at least, both of two objects have room.

        Raises:
            EditRefused: there is no such point.
        """
        for offset in _OFFSETS:
            if all(self._stands(item, where, offset) for item in reversed(both)):
                return offset
        raise EditRefused("no room at the other's place")

    def scene(self, standing: Sequence[tuple[ThorObject, ThorObject, _Offset]]) -> Scene:
        """Return the scene in which some objects stand at places of objects, and the rest nowhere.

        Raises:
            EditRefused: they are in each other's way, or move another object.
        """
        self._clear()
        for item, where, offset in standing:
            if not self._try(item, where, offset):
                raise EditRefused("no room for both at once")
        placed = {item.object_id for item, _, _ in standing}
        for number, key in enumerate(key for key in self._items if key not in placed):
            _lift(self._simulator, self._items[key], _above(number))
        self._check_others()
        return _scene_of(self._scene, self._simulator.view)

    def _stands(self, item: ThorObject, where: ThorObject, offset: _Offset) -> bool:
        """Return True if an object can stand beside a place; it is taken away again."""
        stands = self._try(item, where, offset)
        self._take_away(item)
        return stands

    def _try(self, item: ThorObject, where: ThorObject, offset: _Offset) -> bool:
        """Stand an object beside a place, in line with what is there; return whether it can."""
        simulator = self._simulator
        self._take_away(_turned(item, where))
        waiting = simulator.view.objects[item.object_id]
        container = _container(where, self._before)
        if container is None:
            view = simulator.step(
                "PlaceObjectAtPoint",
                objectId=item.object_id,
                position=_foot(where, offset),
                **NO_RENDERING,
            )
            return view.success and _has_place(view, item, where)
        position = self._inside(waiting, where, container, offset)
        if position is None:
            return False
        _lift(simulator, waiting, position)
        return _has_place(simulator.view, item, where)

    def _inside(
        self, item: ThorObject, where: ThorObject, container: Box, offset: _Offset
    ) -> dict[str, float] | None:
        """Return an object's position in a container, clear of what is there; None for no room."""
        own, other = _box(item), _box(where)
        box = _box_beside(own, other, offset)
        others = [
            obj.axis_aligned_bounding_box
            for obj in self._simulator.view.objects.values()
            if obj.pickupable and obj.object_id != item.object_id
        ]
        is_clear = not any(taken is not None and _meet(box, taken) for taken in others)
        if not is_clear or not _is_within(box, container):
            return None
        return {
            axis: getattr(item.position, axis)
            - getattr(own.center, axis)
            + getattr(box.center, axis)
            for axis in "xyz"
        }

    def _check_others(self) -> None:
        """Check that nothing else moved.

        Raises:
            EditRefused: something did.
        """
        after = self._simulator.view.objects
        tolerance = tolerance_of(self._simulator)
        for key, obj in self._before.items():
            if key in self._items:
                continue
            if obj.parent_receptacles != after[key].parent_receptacles:
                raise EditRefused("the move changed what a third object is in or on")
            if not tolerance.is_same_place(obj.position, after[key].position):
                raise EditRefused("the move moved a third object")


def _scene_of(scene: Scene, view: SimulatorView) -> Scene:
    """Return a scene with the poses of all that can be picked up in a view, sorted by name."""
    poses = [
        ObjectPose(obj.name, asdict(obj.position), asdict(obj.rotation))
        for obj in sorted(view.objects.values(), key=lambda obj: obj.name)
        if obj.pickupable
    ]
    return msgspec.structs.replace(scene, object_poses=poses)


def may_fit(item: ThorObject, where: ThorObject, objects: Mapping[str, ThorObject]) -> bool:
    """Return True if an object is not too large for the place of another one."""
    own = _turned(item, where).axis_aligned_bounding_box
    other = where.axis_aligned_bounding_box
    if own is None or other is None:
        return False
    container = _container(where, objects)
    if container is None:
        return max(own.size.x - other.size.x, own.size.z - other.size.z) <= _WIDER
    return any(_is_within(_box_beside(own, other, offset), container) for offset in _OFFSETS)


def _turned(item: ThorObject, where: ThorObject) -> ThorObject:
    """Return an object as it stands at another one's place: in line with what it stands on.

    Rooms are generated and recorded so; an object in its old rotation would tell the moved one.
    """
    rotation = msgspec.structs.replace(item.rotation, y=where.rotation.y)
    box = item.axis_aligned_bounding_box
    turn = abs(where.rotation.y - item.rotation.y) % 180
    if box is not None and abs(turn - 90) < 45:
        size = msgspec.structs.replace(box.size, x=box.size.z, z=box.size.x)
        box = msgspec.structs.replace(box, size=size)
    return msgspec.structs.replace(item, rotation=rotation, axis_aligned_bounding_box=box)


def _container(where: ThorObject, objects: Mapping[str, ThorObject]) -> Box | None:
    """Return the box of the container or basin that an object is in.

    All of its inside is its body to the simulator, which places nothing there by itself.
    """
    parents = [objects[key] for key in where.parent_receptacles or () if key in objects]
    boxes = [
        parent.axis_aligned_bounding_box
        for parent in parents
        if (parent.openable and parent.object_type != "Toilet")
        or parent.object_type.endswith("Basin")
    ]
    known = [box for box in boxes if box is not None]
    return min(known, key=lambda box: box.size.x * box.size.y * box.size.z, default=None)


def _box_beside(own: Box, other: Box, offset: _Offset) -> Box:
    """Return the box of an object that stands where another one stands, or beside it."""
    x, z = offset
    bottom = other.center.y - other.size.y / 2
    center = Vector(other.center.x + x, bottom + own.size.y / 2, other.center.z + z)
    return msgspec.structs.replace(own, center=center)


def _foot(where: ThorObject, offset: _Offset) -> dict[str, float]:
    """Return the point on the surface beside which an object stands."""
    box = _box(where)
    x, z = offset
    bottom = box.center.y - box.size.y / 2
    return {"x": where.position.x + x, "y": bottom, "z": where.position.z + z}


def _box(obj: ThorObject) -> Box:
    if obj.axis_aligned_bounding_box is None:
        raise EditRefused("the simulator does not report boxes")
    return obj.axis_aligned_bounding_box


def _is_within(inner: Box, outer: Box) -> bool:
    away = _distances(inner, outer)
    return all(
        away[axis] + getattr(inner.size, axis) / 2 <= getattr(outer.size, axis) / 2 + _SLACK
        for axis in away
    )


def _meet(one: Box, other: Box) -> bool:
    away = _distances(one, other)
    return all(
        away[axis] < (getattr(one.size, axis) + getattr(other.size, axis)) / 2 for axis in away
    )


def _distances(one: Box, other: Box) -> dict[str, float]:
    """Return how far the middles of two boxes are from each other along each axis."""
    return {axis: abs(getattr(one.center, axis) - getattr(other.center, axis)) for axis in "xyz"}


def _lift(simulator: Simulator, item: ThorObject, position: dict[str, float]) -> None:
    """Give an object a position, in the air too."""
    simulator.step(
        "TeleportObject",
        objectId=item.object_id,
        position=position,
        rotation=asdict(item.rotation),
        forceAction=True,
        forceKinematic=True,
        **NO_RENDERING,
    )


def _above(number: int) -> dict[str, float]:
    """Return a place above the room."""
    return {"x": 0.0, "y": _FAR + number, "z": 0.0}


def _has_place(view: SimulatorView, item: ThorObject, where: ThorObject) -> bool:
    """Return True if an object is in or on what another one was in or on."""
    parents = view.objects[item.object_id].parent_receptacles or []
    return set(parents) == set(where.parent_receptacles or [])
