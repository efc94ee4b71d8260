"""Whether two replays differ in nothing but what was declared.

Poses of the agent must be equal in every frame, and pictures, within a tolerance, wherever nothing
that differs is in view. What differs is found by comparing logged states, not taken from the edit,
so that a side effect shows.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states
from infthor_eval.formats.twins import ComparedFrame
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import exchange_ids, whole_of
from infthor_eval.generation.twins.tolerance import EXACT, Tolerance

_NEAR = 0.5  # how far a third object may be displaced on its receptacle, metres
_Frame = tuple[Step, dict[str, ObjectState]]


class Difference(Exception):
    """What makes two replays no twins; the message is the reason, the same for all of its kind."""


@dataclass(frozen=True)
class World:
    """The replay of one world.

    Attributes:
        steps: its log.
        pictures: digest of each frame's picture.
        files: file of each frame's picture, which a tolerance needs.
    """

    steps: Sequence[Step]
    pictures: Sequence[str]
    files: Sequence[Path] = ()


def compare(
    worlds: Worlds, first: World, second: World, tolerance: Tolerance = EXACT
) -> tuple[tuple[ComparedFrame, ...], frozenset[str]]:
    """Return how each frame compares, and the ids of the third objects that are displaced.

    Args:
        worlds: what was declared.
        first: replay of the first world.
        second: replay of the second world.
        tolerance: what counts as equal.

    Raises:
        Difference: the agent is not in the same place throughout, an object differs that was not to
            be changed, or a picture differs without a changed thing in view.
    """
    if len(first.steps) != len(second.steps):
        raise Difference("another number of frames")
    comparison = _Comparison(worlds, tolerance)
    states = zip(iter_object_states(first.steps), iter_object_states(second.steps), strict=True)
    compared = []
    for number, (of_first, of_second) in enumerate(states):
        one = first.steps[number]
        other = second.steps[number]
        if one.pose != other.pose:
            raise Difference("the agent is elsewhere")
        in_view = comparison.changed_in_view(
            (one, _existing(of_first)), (other, _existing(of_second))
        )
        same = _is_same_picture(first, second, number, tolerance)
        if not same and not in_view:
            raise Difference("a picture differs though nothing that differs is in view")
        compared.append(ComparedFrame(same, tuple(sorted(in_view))))
    return tuple(compared), frozenset(comparison.displaced)


def _is_same_picture(first: World, second: World, number: int, tolerance: Tolerance) -> bool:
    if first.pictures[number] == second.pictures[number]:
        return True
    if tolerance == EXACT:
        return False
    return tolerance.is_same_picture(first.files[number], second.files[number])


def _existing(states: dict[str, ObjectState]) -> dict[str, ObjectState]:
    return {key: state for key, state in states.items() if state.exists}


class _Comparison:
    """Compares states, with the ids of the first world.

    Attributes:
        displaced: ids of the objects that were put down elsewhere on the same receptacle, as the
            changed one was in the way.
    """

    def __init__(self, worlds: Worlds, tolerance: Tolerance) -> None:
        self.displaced: set[str] = set()
        self._tolerance = tolerance
        self._changed = worlds.changed
        self._new_id = exchange_ids(worlds.ids)
        self._old_id = exchange_ids({new: old for old, new in worlds.ids.items()})

    def changed_in_view(self, first: _Frame, second: _Frame) -> set[str]:
        """Return the ids of what differs and is in view, or in the hand, in either world.

        Raises:
            Difference: an object differs that was not to be changed.
        """
        step, states = first
        other_step, other_states = second
        translated = {self._old_id(key): state for key, state in other_states.items()}
        differing = {
            key
            for key in states.keys() | translated.keys()
            if not self._are_equal(states.get(key), translated.get(key))
        }
        for key in differing:
            if whole_of(key) in self._changed:
                continue
            if not self._are_near(states.get(key), translated.get(key)):
                raise Difference("an object differs that was not to be changed")
            self.displaced.add(key)
        shown = {*(step.seen or {}), *map(self._old_id, other_step.seen or {})}
        held = {
            key
            for key in differing
            if any(key in world and world[key].held for world in (states, translated))
        }
        return differing & shown | held

    def _are_near(self, state: ObjectState | None, other: ObjectState | None) -> bool:
        """Return True if only the position differs, and little."""
        if state is None or other is None:
            return False
        is_near = math.dist(state.position, other.position) <= _NEAR
        return is_near and self._are_equal(state, replace(other, position=state.position))

    def _are_equal(self, state: ObjectState | None, other: ObjectState | None) -> bool:
        """Return True if states are equal, whatever the order of the parents."""
        if state is None or other is None:
            return False
        if not self._tolerance.is_same_place(state.position, other.position):
            return False
        parents = Counter(map(self._new_id, state.parents))
        there = replace(other, parents=(), position=state.position)
        return parents == Counter(other.parents) and replace(state, parents=()) == there
