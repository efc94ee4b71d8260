"""Kinds in which two objects exchange places at the start, and roles in the episode."""

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

from infthor_eval.formats.trajectory import Scene
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import EditRefused, Worlds
from infthor_eval.generation.twins.placing import may_fit, scenes_of_both
from infthor_eval.generation.twins.rewriting import exchange_ids, in_world
from infthor_eval.household.affordances import SLICEABLE, goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

__all__ = ["Exchange", "ExchangeKind", "Move", "Swap", "SwapSliced", "SwapTask", "Untouched"]

_CARRYING = {"PickupObject", "PutObject"}
_SLICING = {"SliceObject"}
_Pair = tuple[ThorObject, ThorObject]


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
        """See `Proposal`: the first world is as the episode, the second with places exchanged."""
        both = self.one, self.other
        exchanged = self.other, self.one
        scenes = scenes_of_both(episode.trajectory.scene, simulator, [both, exchanged])
        ids = [restored_ids(simulator, scene, both) for scene in scenes]
        types = {self.one.object_type: self.other.object_type}
        types |= {new: old for old, new in types.items()}
        is_handled = any(episode.actions_on(obj.object_id) for obj in both)
        roles = (
            {obj.object_id: ids[0][obj.name] for obj in both},
            {
                obj.object_id: ids[1][other.name]
                for obj, other in zip(both, both[::-1], strict=True)
            },
        )
        words: tuple[dict[str, str], dict[str, str]] = ({}, types if is_handled else {})
        first, second = (
            in_world(episode.trajectory, scene, exchange_ids(role), renamed)
            for scene, role, renamed in zip(scenes, roles, words, strict=True)
        )
        return Worlds(
            pair=(first, second),
            changed=frozenset(ids[0].values()),
            types=frozenset(types),
            ids={ids[0][obj.name]: ids[1][obj.name] for obj in both},
        )


def restored_ids(
    simulator: Simulator, scene: Scene, objects: Iterable[ThorObject]
) -> dict[str, str]:
    """Restore a scene, and return the ids that objects have in it, by name.

    Raises:
        EditRefused: it cannot be restored.
        SimulatorError: the simulator fails.
    """
    if restore(simulator, scene).lines():
        raise EditRefused("the exchanged start cannot be restored")
    by_name = {obj.name: obj.object_id for obj in simulator.view.objects.values()}
    return {obj.name: by_name[obj.name] for obj in objects}


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
        for one, other in self.pairs(episode, rng):
            if rng.random() < self.chance(episode, one, other):
                yield Exchange(one, other)

    def pairs(self, episode: Episode, rng: random.Random) -> list[_Pair]:
        """Return the pairs of objects that may exchange places, the likeliest first."""
        loose = [obj for obj in episode.loose if _is_alone(episode, obj)]
        pairs = [
            (one, other)
            for one, other in combinations(loose, 2)
            if self.allows(*(set(episode.actions_on(obj.object_id)) for obj in (one, other)))
            and self._may_exchange(episode, one, other)
        ]
        rng.shuffle(pairs)
        pairs.sort(key=lambda pair: _n_unseen(episode, pair))
        return _spread(pairs)

    def chance(self, episode: Episode, one: ThorObject, other: ThorObject) -> float:
        """Return with what probability an exchange is proposed: 1 if its world is as likely.

        If a world that is half as likely as the episode is proposed half as often, neither of two
        worlds is the likelier original (the rule of Metropolis).
        """
        return 1.0

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


def _n_unseen(episode: Episode, pair: _Pair) -> int:
    return sum(obj.object_id not in episode.history.seen for obj in pair)


def _spread(pairs: Iterable[_Pair]) -> list[_Pair]:
    """Return pairs with those first of which no object is in an earlier one, so that facts vary."""
    first: list[_Pair] = []
    later: list[_Pair] = []
    used: set[str] = set()
    for pair in pairs:
        keys = {obj.object_id for obj in pair}
        (later if keys & used else first).append(pair)
        used |= keys
    return [*first, *later]


def _is_alone(episode: Episode, obj: ThorObject) -> bool:
    """Return True if words are clear: the agent acts on no other of the type, nor puts into it."""
    is_clear = episode.n_handled(obj.object_type) <= bool(episode.actions_on(obj.object_id))
    return is_clear and obj.object_id not in episode.put_targets


class Swap(ExchangeKind):
    """One that is carried exchanges places with one that is not touched."""

    name: ClassVar[str] = "swap"

    def allows(self, first: set[str], second: set[str]) -> bool:
        """See the base."""
        return bool(first) != bool(second) and first | second <= _CARRYING

    def _may_exchange(self, episode: Episode, one: ThorObject, other: ThorObject) -> bool:
        """Return True if each could as well be where the other is, and be what is carried."""
        if not super()._may_exchange(episode, one, other):
            return False
        low, high = sorted(episode.task_shares[obj.object_type] for obj in (one, other))
        return low >= high / 2 > 0

    def chance(self, episode: Episode, one: ThorObject, other: ThorObject) -> float:
        """See the base: how often tasks name what is carried."""
        carried, left = (one, other) if episode.actions_on(one.object_id) else (other, one)
        shares = episode.task_shares
        return shares[left.object_type] / shares[carried.object_type]


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
            if {exchange.one.object_type, exchange.other.object_type} <= SLICEABLE:
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
