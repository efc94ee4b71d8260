"""Rearranging a scene's loose objects, to recorded poses or at random."""

from collections import Counter, defaultdict
from collections.abc import Container, Sequence
from dataclasses import dataclass

import numpy as np

from infthor_sim.geometry import Array, object_id
from infthor_sim.object_types import ObjectType, allowed_in, modern_type, type_named
from infthor_sim.objects import SimObject, default_object
from infthor_sim.physics.free_places import find_place
from infthor_sim.physics.receptacles import find_parent
from infthor_sim.world import World

_SUNK = 0.2  # metres below a surface; what lies deeper is inside the furniture


@dataclass(frozen=True)
class NamedPose:
    """A pose for one object, as AI2-THOR's SetObjectPoses takes it.

    Attributes:
        name: AI2-THOR's name of the object.
        position: metres (3,).
        rotation: Unity's Euler angles in degrees (3,).
    """

    name: str
    position: Array
    rotation: Array


def set_poses(world: World, poses: Sequence[NamedPose], keep_moveable: bool = False) -> list[str]:
    """Give the named objects new poses, and ids by them; loose objects that are not named vanish.

    In a house they keep their ids, as in AI2-THOR. What is named again is copied.

    A name that the scene does not have means any object of its type: the part of a name after the
    type differs between versions of AI2-THOR. Where poses name furniture that can be moved, the
    rest of it vanishes, too. `keep_moveable` leaves it alone, and so do lists that name none: those
    of 2.1.0 had nothing of it.

    Returns:
        The names of nothing that can be moved; all others have their poses all the same.
    """
    chooser = _Templates(world)
    chosen = [chooser.choose(pose.name) for pose in poses]
    furniture = [o for o in chosen if o is not None and not o.type.pickupable]
    clears_furniture = bool(furniture) and not keep_moveable
    world.release()
    for item in list(world.objects.values()):
        is_left = item.type.moveable and clears_furniture and item not in furniture
        if item.type.pickupable or is_left:
            world.remove(item)
    placed: Counter[str] = Counter()
    for pose, template in zip(poses, chosen, strict=True):
        if template is None or (keep_moveable and not template.type.pickupable):
            continue
        name = chooser.known_name(pose.name)
        copies = placed[name]
        placed[name] += 1
        if not (copies or template.type.pickupable):
            world.set_pose(template, pose.position, pose.rotation)
            continue
        if world.keeps_ids:
            new_id = _unused_id(world.objects, template.object_id, "_copy_")
        else:
            new_id = _unused_id(world.objects, object_id(name.split("_", 1)[0], pose.position))
        item = template.duplicate(new_id)
        item.name = f"{name}(Clone)_copy_{copies}" if copies else name
        item.position, item.rotation = pose.position.copy(), pose.rotation.copy()
        item.state.picked_up = False
        world.add(item)
    assign_parents(world)
    _lower_supports(world)
    return [pose.name for pose, template in zip(poses, chosen, strict=True) if template is None]


def _lower_supports(world: World) -> None:
    """Lower surfaces that placed objects would sink into: poses are exacter than boxes."""
    for item in world.objects.values():
        if not _has_surface(item.type):
            continue
        bottoms = [float(o.bounds()[0][1]) for o in world.children(item)]
        level = item.surface_height()
        lowest = min(bottoms, default=level)
        if level - _SUNK < lowest < level - 0.002:
            item.support = lowest - 0.002 - float(item.bounds()[0][1])
            world.mark_changed(item)


def _has_surface(furniture: ObjectType) -> bool:
    """Return whether things stand on it, and not in it."""
    hollow = furniture.encloses or furniture.open_top > 0 or furniture.basin
    return furniture.receptacle and not furniture.pickupable and not hollow


def assign_parents(world: World) -> None:
    """Attach every loose object without a parent to the receptacle that it is in or on."""
    held = world.held_ids()
    for item in world.objects.values():
        if item.type.pickupable and item.parent is None and item.object_id not in held:
            parent = find_parent(world, item)
            if parent is not None:
                world.attach(item, parent)


class _Templates:
    """Chooses the object that a name means: the one of that name, else one of its type.

    Args:
        world: the scene as it is now; removed objects are looked for in its templates.
    """

    def __init__(self, world: World) -> None:
        self._named: dict[str, SimObject] = {}
        self._typed: dict[str, list[SimObject]] = defaultdict(list)
        for item in [
            *(o for listed in world.templates.values() for o in listed),
            *(o for o in world.objects.values() if o.type.pickupable or o.type.moveable),
        ]:
            self._named.setdefault(item.name, item)
            self._typed[item.object_type].append(item)
        self._chosen: dict[str, SimObject] = {}
        self._count: dict[str, int] = defaultdict(int)

    def known_name(self, name: str) -> str:
        """Return the name without what Unity appends to names of copies, if none here has it."""
        return name if name in self._named else name.partition("(Clone)")[0]

    def choose(self, listed: str) -> SimObject | None:
        """Return the object that a name means: always the same; for other names, others in turn."""
        name = self.known_name(listed)
        if name in self._named:
            return self._named[name]
        if name not in self._chosen:
            object_type = modern_type(name.split("_", maxsplit=1)[0])
            candidates = self._typed.get(object_type)
            if not candidates:
                if not type_named(object_type).pickupable:
                    return None
                candidates = [default_object(object_type, np.zeros(3))]
            self._chosen[name] = candidates[self._count[object_type] % len(candidates)]
            self._count[object_type] += 1
        return self._chosen[name]


def _unused_id(taken: Container[str], base: str, mark: str = "|") -> str:
    number = 1
    unused = base
    while unused in taken:
        unused = f"{base}{mark}{number}"
        number = number + 1
    return unused


def ids_by_position(world: World) -> dict[str, str]:
    """Return the ids that AI2-THOR gives loose objects where they are now, by their present ids."""
    if world.keeps_ids:
        return {}
    # A slice keeps its id, whose number says how it is drawn.
    loose = [o for o in world.objects.values() if o.type.pickupable and not _is_slice(o)]
    taken = {*world.objects, *world.disabled}.difference(o.object_id for o in loose)
    renamed = {}
    for item in loose:
        renamed[item.object_id] = _unused_id(taken, object_id(item.object_type, item.position))
        taken.add(renamed[item.object_id])
    return renamed


def _is_slice(item: SimObject) -> bool:
    return f"|{item.object_type}_" in item.object_id


def spawn_randomly(
    world: World,
    random: np.random.Generator,
    excluded_types: frozenset[str],
    kept: frozenset[str],
    in_open_only: bool,
) -> None:
    """Put every loose object into or onto a random receptacle that takes its type and has room.

    Args:
        world: the scene, changed in placed.
        random: random numbers that choose the order of the objects and their receptacles.
        excluded_types: types of receptacles that get nothing.
        kept: ids of objects that stay where they are.
        in_open_only: use no receptacle that hides its contents when closed.
    """
    held = world.held_ids()
    loose = [o for o in world.objects.values() if o.type.pickupable and o.object_id not in kept]
    for index in random.permutation(len(loose)):
        item = loose[index]
        if item.object_id in held:
            continue
        homes = [
            o for o in world.objects.values()
            if o.type.receptacle and not o.type.pickupable and allowed_in(item.object_type,
                                                                          o.object_type)
            and o.object_type not in excluded_types and not (in_open_only and o.type.encloses)
        ]  # fmt: skip
        for home_index in random.permutation(len(homes)):
            placed = find_place(world, item, homes[home_index])
            if placed is not None:
                world.set_pose(item, placed.position, placed.rotation)
                world.attach(item, homes[home_index])
                break
