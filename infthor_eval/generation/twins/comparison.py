"""Whether two replays differ in nothing but what was declared.

Poses of the agent must be equal in every frame, and pictures wherever nothing that differs is in
view. What differs is found by comparing logged states, not taken from the edit, so that a side
effect shows.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states
from infthor_eval.formats.twins import ComparedFrame
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.rewriting import exchange_ids

__all__ = ["Difference", "World", "compare"]


class Difference(Exception):
    """What makes two replays no twins; the message is the reason, the same for all of its kind."""


@dataclass(frozen=True)
class World:
    """The replay of one world.

    Attributes:
        steps: its log.
        pictures: digest of each frame's picture.
    """

    steps: Sequence[Step]
    pictures: Sequence[str]


def compare(worlds: Worlds, first: World, second: World) -> tuple[ComparedFrame, ...]:
    """Return how each frame compares.

    Raises:
        Difference: the agent is not in the same place throughout, an object differs that was not to
            be changed, or a picture differs without a changed thing in view.
    """
    if len(first.steps) != len(second.steps):
        raise Difference("another number of frames")
    new_id = exchange_ids(worlds.ids)
    states = zip(iter_object_states(first.steps), iter_object_states(second.steps), strict=True)
    compared = []
    for number, (of_first, of_second) in enumerate(states):
        one = first.steps[number]
        other = second.steps[number]
        if one.pose != other.pose:
            raise Difference("the agent is elsewhere")
        changed = _changed(worlds, _existing(of_first), _existing(of_second))
        in_second = {new_id(key) for key in changed}
        in_view = (changed & (one.seen or {}).keys()) | {
            key for key in changed if new_id(key) in (other.seen or {}) and new_id(key) in in_second
        }
        same = first.pictures[number] == second.pictures[number]
        if not same and not in_view:
            raise Difference("a picture differs though nothing that differs is in view")
        compared.append(ComparedFrame(same, tuple(sorted(in_view))))
    return tuple(compared)


def _existing(states: dict[str, ObjectState]) -> dict[str, ObjectState]:
    return {key: state for key, state in states.items() if state.exists}


def _changed(
    worlds: Worlds, first: dict[str, ObjectState], second: dict[str, ObjectState]
) -> set[str]:
    """Return the ids, in the first world, of the objects that differ at a frame."""
    new_id = exchange_ids(worlds.ids)
    old_id = exchange_ids({new: old for old, new in worlds.ids.items()})
    changed = {key for key, state in first.items() if not _is_equal(state, second.get(new_id(key)), new_id)}
    changed |= {old_id(key) for key in second if old_id(key) not in first}
    for key in changed:
        if "|".join(key.split("|")[:4]) not in worlds.changed:
            raise Difference("an object differs that was not to be changed")
    return changed


def _is_equal(state: ObjectState, other: ObjectState | None, new_id) -> bool:
    if other is None:
        return False
    if state == other:
        return True
    import msgspec
    mapped = msgspec.structs.replace(state, parents=tuple(map(new_id, state.parents)))
    return Counter(mapped.parents) == Counter(other.parents) and msgspec.structs.replace(mapped, parents=()) == msgspec.structs.replace(other, parents=())
