"""Kinds that differ in states of single objects at the start: what is open, what is there."""

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product
from typing import ClassVar

import msgspec

from infthor_eval.formats.trajectory import StartState, Trajectory
from infthor_eval.generation.questions import presence
from infthor_eval.generation.twins.episode import ASKED_OPEN, Episode
from infthor_eval.generation.twins.exchanges import Untouched, restored_ids
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.placing import scenes_of_both
from infthor_eval.generation.twins.rewriting import in_world
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject

_WITH_DOORS = frozenset({"Cabinet", "Fridge", "Safe"})  # which stand in the way when open


def _with_states(trajectory: Trajectory, *states: StartState) -> Trajectory:
    scene = trajectory.scene
    earlier = scene.object_states or []
    return in_world(trajectory, msgspec.structs.replace(scene, object_states=[*earlier, *states]))


@dataclass(frozen=True)
class _OfTwo:
    """An edit of two objects at the start."""

    one: ThorObject
    other: ThorObject
    index: ClassVar[int] = 0

    @property
    def keys(self) -> frozenset[str]:
        """See `Proposal`."""
        return frozenset({self.one.object_id, self.other.object_id})


@dataclass(frozen=True)
class _Opening(_OfTwo):
    """One of two objects is open for closed or closed for open, against the episode.

    Attributes:
        one: the object that is asked about.
        other: another one, so that neither world is the episode's own.
    """

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`."""
        worlds = []
        for turned, kept in permutations((self.one, self.other)):
            states = {turned.name: not turned.is_open, kept.name: bool(kept.is_open)}
            worlds.append(
                _with_states(
                    episode.trajectory,
                    *(StartState(name, is_open=state) for name, state in sorted(states.items())),
                )
            )
        inside = {key for holder in self.keys for key in episode.inside(holder)}
        return Worlds(
            pair=(worlds[0], worlds[1]),
            changed=self.keys | inside,
            types=frozenset({self.one.object_type, self.other.object_type}),
        )


class Opened:
    """A container that is the only one of its type is opened or closed at the start, or another."""

    name: ClassVar[str] = "state"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_Opening]:
        """See `EditKind`: what frames show and the agent never opens, closes, or takes from."""
        acted = {event.target for event in episode.history.events}
        acted |= episode.put_targets | {
            move.origin for move in episode.history.moves if move.origin
        }
        untouched = [
            obj
            for key, obj in sorted(episode.start.objects.items())
            if obj.openable
            and obj.object_type in ASKED_OPEN
            and key in episode.history.seen - acted
        ]
        single = [obj for obj in untouched if episode.is_only_one(obj)]
        pairs = [
            (one, other)
            for one, other in product(single, untouched)
            if canonical_type(one.object_type) != canonical_type(other.object_type)
        ]
        rng.shuffle(pairs)
        # Each object once before any a second time, and first those in nobody's way.
        used = Counter[str]()

        def rank(pair: tuple[ThorObject, ThorObject]) -> tuple[int, int]:
            return used[pair[0].name], sum(obj.object_type in _WITH_DOORS for obj in pair)

        while pairs:
            best = min(pairs, key=rank)
            pairs.remove(best)
            used[best[0].name] += 1
            yield _Opening(*best)


@dataclass(frozen=True)
class _Replacement(_OfTwo):
    """At one place stands one of two objects; the other one is not in the scene at all.

    Attributes:
        one: an object at its place in the episode.
        other: the object that stands there in the second world.
    """

    def apply(self, episode: Episode, simulator: Simulator) -> Worlds:
        """See `Proposal`: the place where the second object was is empty in both worlds.

        What is not there is put aside in both, as its pose is written, too.
        """
        both = self.one, self.other
        scenes = scenes_of_both(episode.trajectory.scene, simulator, [(self.one, both)])
        ids = [restored_ids(simulator, scene, both) for scene in scenes]
        worlds = [
            _with_states(
                in_world(episode.trajectory, scene), StartState(gone.name, is_disabled=True)
            )
            for scene, gone in zip(scenes, both[::-1], strict=True)
        ]
        return Worlds(
            pair=(worlds[0], worlds[1]),
            changed=frozenset(ids[0].values()),
            types=frozenset({self.one.object_type, self.other.object_type}),
            ids={ids[0][obj.name]: ids[1][obj.name] for obj in both},
            has_own=True,
        )


class Replace:
    """One object that is not touched stands where another one could."""

    name: ClassVar[str] = "replace"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[_Replacement]:
        """See `EditKind`: each is the only one of its type, and can be asked for where it is not.

        Frames show both, so that either may be taken out: if it were always the one that is hidden,
        types that are often hidden would tell. Those of which both can be asked for come first.
        """
        pairs = [
            pair
            for pair in Untouched().pairs(episode, rng)
            if all(map(episode.is_only_one, pair))
            and all(obj.object_id in episode.history.seen for obj in pair)
            and any(_can_be_missed(episode, pair))
        ]
        for pair in sorted(pairs, key=lambda pair: -sum(_can_be_missed(episode, pair))):
            one, other = rng.sample(pair, 2)
            # What has few places is the likelier at each. If a world that is half as likely as the
            # episode is proposed half as often, neither is the likelier original (the rule of
            # Metropolis).
            if rng.random() < _n_places(episode, one) / _n_places(episode, other):
                yield _Replacement(one, other)


def _n_places(episode: Episode, obj: ThorObject) -> int:
    """Return the number of receptacles that an object goes into or onto."""
    objects = episode.start.objects.values()
    return sum(goes_into(obj.object_type, place.object_type) for place in objects)


def _can_be_missed(episode: Episode, pair: tuple[ThorObject, ThorObject]) -> list[bool]:
    """Return for each of two objects whether one can ask for it where it is not."""
    there = episode.history.all_object_types
    names = [canonical_type(obj.object_type) for obj in pair]
    return [presence.is_clear_absence(name, there - {name}) for name in names]
