"""Kinds in which two objects exchange places at the start, and roles in the episode."""

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product
from typing import ClassVar

import msgspec
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import ObjectPose, Scene
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import EditRefused, Worlds
from infthor_eval.generation.twins.rewriting import exchange_ids, in_world
from infthor_eval.household.affordances import SLICEABLE, goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["Exchange", "Move", "Swap", "SwapSliced", "SwapTask"]

_CARRYING = {"PickupObject", "PutObject"}
_SLICING = {"SliceObject"}
# Places beside the other's that are tried, nearest first, metres.
_STEPS = [step / 20 for step in range(-6, 7)]
_OFFSETS = sorted(product(_STEPS, _STEPS), key=lambda offset: math.hypot(*offset))
_FAR = 50.0  # metres above the room, where an object waits for its new place


@dataclass(frozen=True)
class Exchange:
    """Two objects that exchange places; what the agent did with one it does with the other.

    Attributes:
        one: an object at the start.
        other: another object, of another type.
    """

    one: ThorObject
    other: ThorObject

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`: the first world is the episode's, the second has the places exchanged."""
        scene = _exchanged_scene(episode, self.one, self.other, simulator)
        restored = restore(simulator, scene)
        if restored.dropped or restored.refused:
            raise EditRefused("the exchanged start cannot be restored")
        after = _ids_by_name(simulator.view)
        one, other = self.one, self.other
        roles = {one.object_id: after[other.name], other.object_id: after[one.name]}
        types = {one.object_type: other.object_type, other.object_type: one.object_type}
        handled = episode.actions_on(one.object_id) or episode.actions_on(other.object_id)
        trajectory = episode.trajectory
        return Worlds(
            pair=(
                in_world(trajectory, trajectory.scene),
                in_world(trajectory, scene, exchange_ids(roles), types if handled else {}),
            ),
            changed=frozenset(roles),
            types=frozenset(types),
            ids={one.object_id: after[one.name], other.object_id: after[other.name]},
        )


def _ids_by_name(view: SimulatorView) -> dict[str, str]:
    return {obj.name: obj.object_id for obj in view.objects.values()}


def _exchanged_scene(
    episode: Episode, one: ThorObject, other: ThorObject, simulator: Simulator
) -> Scene:
    """Exchange two objects in the restored scene, and return it in the form of trajectories."""
    scene = episode.trajectory.scene
    restore(simulator, scene)
    before = simulator.view.objects
    simulator.step(
        "TeleportObject",
        objectId=other.object_id,
        position={"x": 0.0, "y": _FAR, "z": 0.0},
        rotation=asdict(other.rotation),
        forceAction=True,
        forceKinematic=True,
    )
    _place(simulator, one, other, other.parent_receptacles or [])
    _place(simulator, other, one, one.parent_receptacles or [])
    after = simulator.view.objects
    moved = {one.object_id, other.object_id}
    for key, obj in before.items():
        if key not in moved and obj.parent_receptacles != after[key].parent_receptacles:
            raise EditRefused("the exchange changed where a third object is")
        if key not in moved and obj.position != after[key].position:
            raise EditRefused("the exchange moved a third object")
    for key, partner in ((one.object_id, other), (other.object_id, one)):
        if after[key].parent_receptacles != before[partner.object_id].parent_receptacles:
            raise EditRefused("an object is not where the other was")
    poses = [
        ObjectPose(obj.name, asdict(obj.position), asdict(obj.rotation))
        for obj in after.values()
        if obj.pickupable
    ]
    return msgspec.structs.replace(scene, object_poses=poses)


def _place(simulator: Simulator, item: ThorObject, where: ThorObject, target: list[str]) -> None:
    """Stand an object where another one stood, or as near to it as there is room.

    Args:
        simulator: simulator with the restored scene.
        item: the object.
        where: the other one, before it was moved.
        target: ids of the receptacles that the other one was in or on.
    """
    box = where.axis_aligned_bounding_box
    if box is None:
        raise EditRefused("the simulator does not report boxes")
    bottom = box.center.y - box.size.y / 2
    for x, z in _OFFSETS:
        point = {"x": where.position.x + x, "y": bottom, "z": where.position.z + z}
        view = simulator.step("PlaceObjectAtPoint", objectId=item.object_id, position=point)
        if view.success and view.objects[item.object_id].parent_receptacles == target:
            return
    raise EditRefused("no room at the other's place")


def _may_exchange(episode: Episode, one: ThorObject, other: ThorObject) -> bool:
    """Return True if each could as well be where the other is, and is put.

    Places are of different types, or no answer would change.
    """
    if canonical_type(one.object_type) == canonical_type(other.object_type):
        return False
    places = [episode.holder(obj.object_id) for obj in (one, other)]
    at_one, at_other = (place.object_type if place is not None else "" for place in places)
    if canonical_type(at_one) == canonical_type(at_other):
        return False
    return _fits(episode, one, other, at_other) and _fits(episode, other, one, at_one)


def _fits(episode: Episode, item: ThorObject, partner: ThorObject, place: str) -> bool:
    """Return True if an object goes where its partner is at the start, and is put."""
    objects = episode.start.objects
    targets = [objects[key].object_type for key in episode.targets_of(partner.object_id)]
    return all(goes_into(item.object_type, target) for target in (place, *targets))


def _is_alone(episode: Episode, obj: ThorObject) -> bool:
    """Return True if the agent acts on no other object of the type, so that words are clear."""
    return episode.n_handled(obj.object_type) <= bool(episode.actions_on(obj.object_id))


class _Exchanges:
    """Base of the kinds of exchange: all pairs of objects of which both allow it."""

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Exchange]:
        """See `EditKind`."""
        loose = [obj for obj in episode.loose if _is_alone(episode, obj)]
        pairs = list(combinations(loose, 2))
        rng.shuffle(pairs)
        for one, other in pairs:
            roles = [set(episode.actions_on(obj.object_id)) for obj in (one, other)]
            if self.allows(*roles) and _may_exchange(episode, one, other):
                yield Exchange(one, other)

    def allows(self, first: set[str], second: set[str]) -> bool:
        """Return True for two objects with these names of actions on them."""
        raise NotImplementedError


class Swap(_Exchanges):
    """One that is carried exchanges places with one that is not touched."""

    name: ClassVar[str] = "swap"

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return bool(first) != bool(second) and first | second <= _CARRYING


class SwapTask(_Exchanges):
    """Two that are carried exchange places and tasks, and so their order."""

    name: ClassVar[str] = "swap-task"

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return bool(first and second) and first | second <= _CARRYING


class SwapSliced(_Exchanges):
    """Two foods exchange places, of which at least one is cut."""

    name: ClassVar[str] = "swap-sliced"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Exchange]:
        """See `EditKind`."""
        for exchange in super().propose(episode, rng):
            if {exchange.one.object_type, exchange.other.object_type} <= SLICEABLE:
                yield exchange

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        both = first | second
        return bool(both & _SLICING) and both <= _CARRYING | _SLICING


class Move(_Exchanges):
    """Two that are not touched exchange places."""

    name: ClassVar[str] = "move"

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return not first and not second
