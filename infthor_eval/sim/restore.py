"""Rearranging a scene's loose objects: to recorded poses, or at random."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from infthor_eval.sim.default_objects import default_object
from infthor_eval.sim.geometry import Array, object_id, to_array
from infthor_eval.sim.object_types import ObjectType, allowed_in, type_named
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import find_place, owner_of
from infthor_eval.sim.world import World

__all__ = ["NamedPose", "set_poses", "settle_parents", "spawn_randomly"]

_SUNK = 0.2  # metres; what lies deeper is inside
_RENAMED = {"Glassbottle": "Bottle"}  # as ALFRED's AI2-THOR 2.1.0 calls it


@dataclass(frozen=True)
class NamedPose:
    """Where one object is to be: by name, as AI2-THOR's SetObjectPoses takes it."""

    name: str
    position: Array
    rotation: Array

    @classmethod
    def from_wire(cls, entry: Mapping[str, Any]) -> "NamedPose":
        """From `{"objectName", "position", "rotation"}`."""
        rotation = entry.get("rotation") or {}
        return cls(entry["objectName"].removesuffix("(Clone)"), to_array(entry["position"]), to_array(rotation))


def set_poses(world: World, poses: Iterable[NamedPose], keep_moveable: bool = False) -> None:
    """Give the named objects new poses and new ids made from them; loose objects that are not named vanish.

    Names of other versions of AI2-THOR differ after the type: a name that the scene does not have is taken by type.
    """
    chooser = _Templates(world)
    world.release()
    for item in [o for o in world.objects.values() if o.type.pickupable]:
        world.remove(item)
    for pose in poses:
        template = chooser.choose(pose.name)
        if template is None:
            continue
        if not template.type.pickupable:
            if not keep_moveable:
                world.set_pose(template, pose.position, pose.rotation)
            continue
        item = template.duplicate(_unused(world, pose.name.split("_", 1)[0], pose.position))
        item.name, item.position, item.rotation = pose.name, pose.position.copy(), pose.rotation.copy()
        item.state.picked_up = False
        world.add(item)
    settle_parents(world)
    _lower_supports(world)


def _lower_supports(world: World) -> None:
    """Lowers surfaces that recorded things would be sunk in: where things were put tells how high a table is."""
    for item in world.objects.values():
        if not _has_surface(item.type):
            continue
        bottoms = [float(o.bounds()[0][1]) for o in world.children(item)]
        level = item.surface_height()
        lowest = min(bottoms, default=level)
        if level - _SUNK < lowest < level - 0.002:
            item.support = lowest - 0.002 - float(item.bounds()[0][1])
            world.touch(item)


def _has_surface(furniture: ObjectType) -> bool:
    """Whether things stand on it, and not in it."""
    hollow = furniture.encloses or furniture.open_top > 0 or furniture.basin
    return furniture.receptacle and not furniture.pickupable and not hollow


def settle_parents(world: World) -> None:
    """Find for every loose object without a parent the receptacle that it stands in or on."""
    carried = world.carried()
    for item in world.objects.values():
        if item.type.pickupable and item.parent is None and item.object_id not in carried:
            owner = owner_of(world, item)
            if owner is not None:
                world.attach(item, owner)


class _Templates:
    """Finds the object that a name means, by exact name first and by type else."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._named: dict[str, SimObject] = {}
        self._typed: dict[str, list[SimObject]] = defaultdict(list)
        for item in [*(o for listed in world.templates.values() for o in listed), *world.objects.values()]:
            self._named.setdefault(item.name, item)
            self._typed[item.object_type].append(item)
        self._chosen: dict[str, SimObject] = {}
        self._count: dict[str, int] = defaultdict(int)

    def choose(self, name: str) -> SimObject | None:
        if name in self._named:
            return self._named[name]
        if name not in self._chosen:
            prefix = name.split("_", maxsplit=1)[0]
            object_type = _RENAMED.get(prefix, prefix)
            known = self._typed.get(object_type) or self._defaults(object_type)
            if not known:
                return None
            self._chosen[name] = known[self._count[object_type] % len(known)]
            self._count[object_type] += 1
        return self._chosen[name]

    def _defaults(self, object_type: str) -> list[SimObject]:
        return [default_object(object_type, np.zeros(3))] if type_named(object_type).pickupable else []


def _unused(world: World, object_type: str, position: Array) -> str:
    wanted = object_id(object_type, position)
    number, found = 1, wanted
    while found in world.objects:
        found, number = f"{wanted}|{number}", number + 1
    return found


def spawn_randomly(
    world: World,
    random: np.random.Generator,
    excluded_types: frozenset[str],
    kept: frozenset[str],
    in_open_only: bool,
) -> None:
    """Put every loose object that is not `kept` into a random receptacle that takes its type and has room."""
    carried = world.carried()
    loose = [o for o in world.objects.values() if o.type.pickupable and o.object_id not in kept]
    for index in random.permutation(len(loose)):
        item = loose[index]
        if item.object_id in carried:
            continue
        homes = [
            o for o in world.objects.values()
            if o.type.receptacle and not o.type.pickupable and allowed_in(item.object_type, o.object_type)
            and o.object_type not in excluded_types and not (in_open_only and o.type.encloses)
        ]  # fmt: skip
        for home_index in random.permutation(len(homes)):
            place = find_place(world, item, homes[home_index])
            if place is not None:
                world.set_pose(item, place.position, place.rotation)
                world.attach(item, homes[home_index])
                break
