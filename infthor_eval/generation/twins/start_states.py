"""Kinds that differ in states of single objects at the start: what is open, what is there."""

import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from typing import ClassVar

import msgspec

from infthor_eval.formats.trajectory import Scene, StartState, Trajectory
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.exchanges import Exchange, Move
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import in_world
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

__all__ = ["Opened", "Replace"]

# What people would ask about as open or closed, and what can stand open without a hand on it.
_ASKED = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "Laptop", "Microwave", "Safe"})


def _with_states(trajectory: Trajectory, *states: StartState) -> Trajectory:
    scene = trajectory.scene
    earlier = scene.object_states or []
    return in_world(
        trajectory, msgspec.structs.replace(scene, object_states=[*earlier, *states])
    )


@dataclass(frozen=True)
class _Opening:
    """One of two objects is open at the start, the other closed; and the other way round."""

    one: ThorObject
    other: ThorObject

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:  # noqa: ARG002
        """See `Proposal`."""
        worlds = []
        for open_one, closed in permutations((self.one, self.other)):
            states = StartState(open_one.name, is_open=True), StartState(closed.name, is_open=False)
            worlds.append(_with_states(episode.trajectory, *states))
        both = {self.one.object_id, self.other.object_id}
        inside = (key for key in both for key in episode.inside(key))
        return Worlds(
            pair=(worlds[0], worlds[1]),
            changed=frozenset(both.union(inside)),
            types=frozenset({self.one.object_type, self.other.object_type}),
        )


class Opened:
    """Of two containers, each the only one of its type, one is open at the start."""

    name: ClassVar[str] = "state"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_Opening]:
        """See `EditKind`: only what the agent never opens or closes."""
        acted = {event.target for event in episode.history.events}
        acted |= {event.receptacle for event in episode.history.events if event.receptacle}
        single = [
            obj
            for key, obj in sorted(episode.start.objects.items())
            if obj.openable
            and obj.object_type in _ASKED
            and key not in acted
            and episode.history.is_only_one(0, key)
        ]
        pairs = list(combinations(single, 2))
        rng.shuffle(pairs)
        for one, other in pairs:
            yield _Opening(one, other)


@dataclass(frozen=True)
class _Replacement:
    """At one place stands one of two objects; the other one is not in the scene at all."""

    exchange: Exchange

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`: the place where the second object was is empty in both worlds."""
        exchange = self.exchange
        worlds = exchange.apply(episode, simulator)
        first, second = worlds.pair
        gone = [
            StartState(obj.name, is_disabled=True) for obj in (exchange.other, exchange.one)
        ]
        return replace(
            worlds, pair=(_with_states(first, gone[0]), _with_states(second, gone[1]))
        )


class Replace(Move):
    """One object that is not touched stands where another one could."""

    name: ClassVar[str] = "replace"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_Replacement]:  # type: ignore[override]
        """See `EditKind`: only what is seen, and each the only one of its type."""
        for exchange in super().propose(episode, rng):
            if all(episode.is_only_one(obj) for obj in (exchange.one, exchange.other)):
                yield _Replacement(exchange)
