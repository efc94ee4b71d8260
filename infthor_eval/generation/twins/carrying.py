"""Kinds in which the agent carries something more: another thing, or elsewhere, in each world.

At a moment at which its hand is free it picks up what stands before it, and puts it down there.
"""

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import ClassVar

from infthor_eval.formats.trajectory import ApiAction
from infthor_eval.generation.questions.counting import ALL
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.insertions import Insertion, in_reach, moments
from infthor_eval.generation.twins.kinds import varied
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import ThorObject

_CARRYING = {"PickupObject", "PutObject"}
_LEAST_MOVES = 2  # of an object; how often it was moved is asked from then on


@dataclass(frozen=True)
class _Carry:
    """An object is picked up and put somewhere in reach.

    Attributes:
        item: the object.
        place: the receptacle.
    """

    item: ThorObject
    place: ThorObject

    @property
    def keys(self) -> tuple[str, str]:
        """Ids of both."""
        return self.item.object_id, self.place.object_id

    @property
    def actions(self) -> list[ApiAction]:
        """The two actions."""
        item, place = self.keys
        return [ApiAction("PickupObject", item), ApiAction("PutObject", item, place)]

    def is_unlike(self, other: "_Carry") -> bool:
        """Return True if the objects have different names."""
        return _name(self.item) != _name(other.item)


def _insertion(
    index: int, first: Iterable[_Carry], second: Iterable[_Carry], *further: str
) -> Insertion:
    """Return the edit in which each world has its things carried at one moment."""
    worlds = list(first), list(second)
    one, other = ([action for carry in carries for action in carry.actions] for carries in worlds)
    both = [*worlds[0], *worlds[1]]
    types = {obj.object_type for carry in both for obj in (carry.item, carry.place)}
    keys = frozenset(carry.item.object_id for carry in both)
    return Insertion(index, (one, other), keys, frozenset(types.union(further)))


def _clearest(
    episode: Episode, options: Iterable[tuple[int, _Carry, _Carry]]
) -> list[tuple[int, _Carry, _Carry]]:
    """Return each two carries once, at the moment whose frame shows all of them best, by id."""
    found: dict[tuple[str, ...], tuple[_Carry, _Carry, list[int]]] = {}
    for index, one, other in options:
        found.setdefault((*one.keys, *other.keys), (one, other, []))[2].append(index)
    best = []
    for keys, (one, other, indices) in sorted(found.items()):
        clearest = episode.history.clearest(sorted(indices), *keys)
        best += [] if clearest is None else [(clearest, one, other)]
    return best


def _carries_back(episode: Episode, frame: int) -> list[_Carry]:
    """Return how each thing in reach can be picked up and put back where it is.

    Nothing stands in or on it, no other thing of its name is in the frame or handled, and the
    agent's hand is free.
    """
    history = episode.history
    states = history.states(frame)
    if any(state.held for state in states.values()):
        return []
    reachable = {obj.object_id: obj for obj in in_reach(episode, frame)}
    holders = {parent for state in states.values() for parent in state.parents}
    carries = []
    for key, item in reachable.items():
        place = reachable.get(history.parent(frame, key) or "")
        is_loose = item.pickupable and key not in holders
        if is_loose and place is not None and _is_plain(episode, frame, item, place):
            carries.append(_Carry(item, place))
    return carries


def _is_plain(episode: Episode, frame: int, item: ThorObject, place: ThorObject) -> bool:
    """Return True if it is clear which object is carried from and to which place."""
    actions = episode.actions_on(item.object_id)
    is_clear = episode.n_handled(item.object_type) <= bool(actions) and set(actions) <= _CARRYING
    is_open = episode.history.states(frame)[place.object_id].is_open is not False
    return (
        is_clear
        and not place.pickupable
        and (is_open or place.object_type == "Toilet")  # things stand on its tank
        and episode.history.is_alone_in_frame(frame, item.object_id)
    )


def _name(obj: ThorObject) -> str:
    return canonical_type(obj.object_type)


class CountKind:
    """Base of the counts: one thing is carried once more than another one, which is not touched.

    "How often" cannot be asked about a thing that was never carried, so both worlds may start with
    the same carries.
    """

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Insertion]:
        """See `EditKind`: each two things once before one of them a second time."""
        options = (
            (index, one, other)
            for index in moments(episode, rng)
            for one, other in permutations(_carries_back(episode, index), 2)
            if self._may_differ(episode, one, other)
        )
        edits = _clearest(episode, options)
        rng.shuffle(edits)
        for index, one, other in varied(edits, _items):
            before = self.carries_before(episode, one, other)
            yield _insertion(index, [*before, one], [*before, other], ALL)

    def _may_differ(self, episode: Episode, one: _Carry, other: _Carry) -> bool:
        """Return True if the things can be distinguished, and their moves be counted."""
        key = one.item.object_id
        moves = episode.history.moves_of(key)
        is_counted = len(moves) == episode.history.pickups[key]
        return (
            one.is_unlike(other)
            and not episode.actions_on(other.item.object_id)
            and is_counted
            and all(map(episode.history.shows_put, moves))
            and self.suits(episode, one, other)
        )

    def suits(self, episode: Episode, one: _Carry, other: _Carry) -> bool:
        """Return True if the kind is about these places."""
        raise NotImplementedError

    def carries_before(self, episode: Episode, one: _Carry, other: _Carry) -> list[_Carry]:
        """Return what is carried in both worlds first."""
        raise NotImplementedError


def _items(edit: tuple[int, _Carry, _Carry]) -> set[str]:
    return {carry.item.object_id for carry in edit[1:]}


class CountMove(CountKind):
    """One thing is moved once more than another one at a like place."""

    name: ClassVar[str] = "count-move"

    def suits(self, episode: Episode, one: _Carry, other: _Carry) -> bool:
        """See the base."""
        return _name(one.place) == _name(other.place)

    def carries_before(self, episode: Episode, one: _Carry, other: _Carry) -> list[_Carry]:
        """See the base."""
        n_moves = len(episode.history.moves_of(one.item.object_id))
        return [one] * max(0, _LEAST_MOVES - n_moves)


class CountPut(CountKind):
    """Something is put once more at one place than at another one."""

    name: ClassVar[str] = "count-put"

    def suits(self, episode: Episode, one: _Carry, other: _Carry) -> bool:
        """See the base: both places are the only ones of their names."""
        is_told = _name(one.place) != _name(other.place)
        return is_told and episode.is_only_one(one.place) and episode.is_only_one(other.place)

    def carries_before(self, episode: Episode, one: _Carry, other: _Carry) -> list[_Carry]:
        """See the base."""
        return [carry for carry in (one, other) if carry.place.object_id not in episode.put_targets]


class PutTarget:
    """A thing is picked up and put at one of two places, where it stays."""

    name: ClassVar[str] = "put-target"

    def propose(self, episode: Episode, rng: random.Random) -> Iterator[Insertion]:
        """See `EditKind`: each thing once before any a second time.

        Places where it was not before come first.
        """
        options = (
            (index, one, other)
            for index in moments(episode, rng)
            for carry in _carries_back(episode, index)
            if not _is_used_later(episode, index, carry)
            for one, other in combinations(_targets(episode, index, carry), 2)
            if _name(one.place) != _name(other.place)
        )
        edits = _clearest(episode, options)
        rng.shuffle(edits)
        edits.sort(key=lambda edit: _n_back(episode, *edit))
        for index, one, other in varied(edits, _items):
            yield _insertion(index, [one], [other])


def _is_used_later(episode: Episode, index: int, carry: _Carry) -> bool:
    events = episode.history.events
    return any(event.frame > index and event.target == carry.item.object_id for event in events)


def _targets(episode: Episode, frame: int, back: _Carry) -> list[_Carry]:
    """Return the carries of a thing to where it is, and to all else in reach that may hold it."""
    others = (
        obj
        for obj in in_reach(episode, frame)
        if obj.receptacle
        and not obj.openable
        and not obj.pickupable
        and goes_into(back.item.object_type, obj.object_type)
        and obj.object_id != back.place.object_id
    )
    return [back, *(_Carry(back.item, obj) for obj in others)]


def _n_back(episode: Episode, index: int, one: _Carry, other: _Carry) -> int:
    """Return how many of two carries put a thing back."""
    parent = episode.history.parent(index, one.item.object_id)
    return sum(carry.place.object_id == parent for carry in (one, other))
