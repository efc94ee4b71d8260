"""Kinds in which objects exchange places at the start, and roles in the episode."""

import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar, TypeVar

from infthor_eval.formats.trajectory import Scene, Trajectory
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import EditRefused, Worlds, varied
from infthor_eval.generation.twins.placing import may_fit, scenes_of_both
from infthor_eval.generation.twins.rewriting import exchange_ids, in_world
from infthor_eval.household.affordances import SLICEABLE, goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

_CARRYING = {"PickupObject", "PutObject"}
_SLICING = {"SliceObject"}
_Pair = tuple[ThorObject, ThorObject]
_Group = TypeVar("_Group", bound=tuple[ThorObject, ...])


@dataclass(frozen=True)
class Exchange:
    """Objects exchange places; what the agent did with one it does with the one at its place.

    Attributes:
        pairs: the two that exchange places in either world; None in the one that is the episode's
            own.
    """

    pairs: tuple[_Pair | None, _Pair]
    index: ClassVar[int] = 0

    @property
    def keys(self) -> frozenset[str]:
        """See `Proposal`."""
        return frozenset(obj.object_id for obj in self.objects)

    @property
    def objects(self) -> tuple[ThorObject, ...]:
        """All that exchange places in one of the worlds."""
        known = {obj.object_id: obj for pair in self.pairs if pair is not None for obj in pair}
        return tuple(known.values())

    def partner(self, world: int, obj: ThorObject) -> ThorObject:
        """Return the object at whose place another is in a world, and which is at its place."""
        pair = self.pairs[world]
        if pair is None or obj.object_id not in {one.object_id for one in pair}:
            return obj
        return pair[pair[0].object_id == obj.object_id]

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`."""
        objects = self.objects
        places = [(obj, (self.partner(0, obj), self.partner(1, obj))) for obj in objects]
        scenes = scenes_of_both(episode.trajectory.scene, simulator, places)
        ids = [restored_ids(simulator, scene, objects) for scene in scenes]
        first, second = (
            self._world(episode, number, scene, ids[number]) for number, scene in enumerate(scenes)
        )
        return Worlds(
            pair=(first, second),
            changed=frozenset(ids[0].values()),
            types=frozenset(obj.object_type for obj in objects),
            ids={ids[0][obj.name]: ids[1][obj.name] for obj in objects},
            has_own=self.pairs[0] is None,
        )

    def _world(
        self, episode: Episode, number: int, scene: Scene, ids: Mapping[str, str]
    ) -> Trajectory:
        """Return the episode in a world, by the ids that objects have in its scene."""
        partners = [(obj, self.partner(number, obj)) for obj in self.objects]
        is_handled = any(episode.actions_on(obj.object_id) for obj in self.objects)
        types = {obj.object_type: other.object_type for obj, other in partners if obj != other}
        return in_world(
            episode.trajectory,
            scene,
            exchange_ids({obj.object_id: ids[other.name] for obj, other in partners}),
            types if is_handled else {},
        )


def restored_ids(
    simulator: Simulator, scene: Scene, objects: Iterable[ThorObject]
) -> dict[str, str]:
    """Restore a scene, and return the ids that objects have in it, by name.

    Raises:
        EditRefused: it cannot be restored.
        SimulatorError: the simulator fails.
    """
    dropped = restore(simulator, scene).lines()
    by_name = {obj.name: obj.object_id for obj in simulator.view.objects.values()}
    names = [obj.name for obj in objects]
    if dropped or not by_name.keys() >= set(names):
        raise EditRefused("the exchanged start cannot be restored")
    return {name: by_name[name] for name in names}


class ExchangeKind:
    """Base of the kinds of exchange: all pairs of objects of which both allow it.

    Those of which frames show both come first. Objects whose sizes differ much are left out: there
    is seldom room for the larger one.

    Attributes:
        needs_other_place: True if an exchange within one type of place changes no answer.
    """

    needs_other_place: ClassVar[bool] = False

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Exchange]:
        """See `EditKind`."""
        for pair in self.pairs(episode, rng):
            yield Exchange((None, pair))

    def pairs(self, episode: Episode, rng: random.Random) -> list[_Pair]:
        """Return the pairs of objects that may exchange places, the likeliest first."""
        loose = [obj for obj in episode.loose if _is_alone(episode, obj)]
        pairs = [
            (one, other)
            for one, other in combinations(loose, 2)
            if self.allows(*(set(episode.actions_on(obj.object_id)) for obj in (one, other)))
            and self._may_exchange(episode, one, other)
        ]
        return _in_order(episode, rng, pairs)

    def allows(self, first: set[str], second: set[str]) -> bool:
        """Return True for two objects with these names of actions on them."""
        raise NotImplementedError

    def _may_exchange(self, episode: Episode, one: ThorObject, other: ThorObject) -> bool:
        """Return True if each could as well be where the other is, and is put.

        Where they are must be in the published table, too, as where they go is: simulators put some
        things elsewhere, and no exchange does, so that such a place would tell the original.
        """
        if canonical_type(one.object_type) == canonical_type(other.object_type):
            return False
        places = [episode.holder(obj.object_id) for obj in (one, other)]
        at_one, at_other = (place.object_type if place is not None else "" for place in places)
        if not (goes_into(one.object_type, at_one) and goes_into(other.object_type, at_other)):
            return False
        if self.needs_other_place and canonical_type(at_one) == canonical_type(at_other):
            return False
        return self._fits(episode, one, other, at_other) and self._fits(episode, other, one, at_one)

    def _fits(self, episode: Episode, item: ThorObject, partner: ThorObject, place: str) -> bool:
        """Return True if an object goes where its partner is at the start, and is put."""
        objects = episode.start.objects
        if not may_fit(item, partner, objects) or not goes_into(item.object_type, place):
            return False
        return all(
            goes_into(item.object_type + episode.suffix(move), objects[move.target].object_type)
            for move in episode.moves_of(partner.object_id)
        )


def _in_order(episode: Episode, rng: random.Random, groups: list[_Group]) -> list[_Group]:
    """Return groups of objects by chance, those that frames show first.

    Among these are first those of which no object is in an earlier one, so that facts vary.
    """
    rng.shuffle(groups)
    groups.sort(key=lambda group: sum(obj.object_id not in episode.history.seen for obj in group))
    return varied(groups, lambda group: {obj.object_id for obj in group})


def _is_alone(episode: Episode, obj: ThorObject) -> bool:
    """Return True if words are clear: the agent acts on no other of the type, nor puts into it."""
    is_clear = episode.n_handled(obj.object_type) <= bool(episode.actions_on(obj.object_id))
    return is_clear and obj.object_id not in episode.put_targets


class Swap(ExchangeKind):
    """One of two that are not touched is at the place of one that is carried, and carried for it.

    Neither world is the episode's own: what a room's tasks name most often would tell it.
    """

    name: ClassVar[str] = "swap"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Exchange]:
        """See `EditKind`."""
        partners: dict[str, list[_Pair]] = {}
        for one, other in self.pairs(episode, rng):
            pair = (one, other) if episode.actions_on(one.object_id) else (other, one)
            partners.setdefault(pair[0].object_id, []).append(pair)
        groups = [
            (carried, one, other)
            for pairs in partners.values()
            for (carried, one), (_, other) in combinations(pairs, 2)
            if canonical_type(one.object_type) != canonical_type(other.object_type)
        ]
        for carried, one, other in _in_order(episode, rng, groups):
            yield Exchange(((carried, one), (carried, other)))

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return bool(first) != bool(second) and first | second <= _CARRYING


class SwapTask(ExchangeKind):
    """Two that are carried exchange places and tasks, and so their order."""

    name: ClassVar[str] = "swap-task"

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return bool(first and second) and first | second <= _CARRYING


class SwapSliced(ExchangeKind):
    """Two foods exchange places, of which at least one is cut."""

    name: ClassVar[str] = "swap-sliced"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Exchange]:
        """See `EditKind`."""
        for exchange in super().propose(episode, rng):
            if {obj.object_type for obj in exchange.objects} <= SLICEABLE:
                yield exchange

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        both = first | second
        return bool(both & _SLICING) and both <= _CARRYING | _SLICING


class Untouched(ExchangeKind):
    """Base of the kinds of two objects that are not touched."""

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return not first and not second


class Move(Untouched):
    """Two that are not touched exchange places."""

    name: ClassVar[str] = "move"
    needs_other_place: ClassVar[bool] = True
