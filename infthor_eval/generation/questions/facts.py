"""Facts of frames, for the independent check of questions, and how to read them.

They share no code with the rules, so they do not share their errors; they share the table of sizes.
"""

import re
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states
from infthor_eval.generation.questions.history import SHARE_FACTOR

__all__ = [
    "FrameFacts",
    "events_of",
    "frame_facts",
    "holder_of",
    "ids_inside",
    "is_of_type",
    "named_type",
    "only_loose",
    "place_of",
    "plain_name",
    "target_is",
    "target_name",
    "whole_id",
]

_FRAME_PIXELS = 300 * 300


@dataclass(frozen=True)
class FrameFacts:
    """What is known at one frame.

    Attributes:
        number: number of the frame.
        action: name of the successful action before it, or empty.
        target: id of the object acted on.
        objects: states of the known objects by id.
        in_frame: ids of all objects in the frame, however small.
        everything: True if `objects` has all objects, False if only those in the frame.
        loose: types that can be picked up, which is general knowledge and not restricted to the
            frame.
    """

    number: int
    action: str
    target: str | None
    objects: dict[str, ObjectState]
    in_frame: frozenset[str]
    everything: bool
    loose: frozenset[str]


def frame_facts(
    steps: Sequence[Step], share: float, frames: Container[int] | None = None
) -> list[FrameFacts]:
    """Return the facts of the log, or what clue frames show: objects of this share of pixels."""
    facts = []
    loose = frozenset(name for step in steps for name in step.object_log.pickupable)
    for step, states in zip(steps, iter_object_states(steps), strict=True):
        objects = {key: state for key, state in states.items() if state.exists}
        if frames is not None:
            if step.img_idx not in frames:
                continue
            seen = step.seen or {}
            smallest = share * _FRAME_PIXELS
            objects = {
                key: state for key, state in objects.items()
                if key in seen and seen[key].pixels >= smallest * SHARE_FACTOR.get(state.type, 1.0)
            }  # fmt: skip
        facts.append(
            FrameFacts(
                number=step.img_idx,
                action=(step.action or "").split(" ")[0] if step.success else "",
                target=step.target,
                objects=objects,
                in_frame=frozenset(step.seen or {}),
                everything=frames is None,
                loose=loose,
            )
        )
    return facts


def plain_name(object_type: str) -> str:
    """Return a type as answers have it: in small letters, and a basin as its whole."""
    return object_type.lower().replace(" ", "").removesuffix("basin")


def named_type(words: str) -> str:
    """Return the type for some words: "sliced apple" is AppleSliced."""
    words = words.lower()
    if words.startswith("sliced "):
        words = f"{words.removeprefix('sliced ')}sliced"
    return plain_name(words)


def is_of_type(state: ObjectState, words: str) -> bool:
    """Return True if an object is of the type that some words name."""
    return plain_name(state.type) == named_type(words)


def holder_of(frame: FrameFacts, key: str) -> str | None:
    """Return what an object is directly in: the parent that is in most of the others."""
    # Not by `household.containment`, which the rules use: an independent check must not share its
    # errors.
    state = frame.objects[key]
    parents = [parent for parent in state.parents if parent in frame.objects]
    parents = [parent for parent in parents if frame.objects[parent].type != "Floor"]
    if state.held or not parents:
        return None

    def depth(parent: str) -> tuple[int, int]:
        candidate = frame.objects[parent]
        n_within = sum(other in candidate.parents for other in parents)
        return n_within, candidate.type.endswith("Basin")

    return max(parents, key=depth)


def whole_id(key: str | None) -> str | None:
    """Return the id of the whole for that of a part ("Sink|x|y|z|SinkBasin")."""
    return None if key is None else "|".join(key.split("|")[:4])


def place_of(frame: FrameFacts, key: str) -> str | None:
    """Return the type of what an object is directly in or on."""
    holder = holder_of(frame, key)
    return None if holder is None else plain_name(frame.objects[holder].type)


def ids_inside(frame: FrameFacts, words: str) -> set[str]:
    """Return the ids of what is in or on a receptacle of a type."""
    return {key for key in frame.objects if place_of(frame, key) == named_type(words)}


def events_of(
    facts: Sequence[FrameFacts], action: str, words: str | None = None
) -> list[FrameFacts]:
    """Return the facts right after an action on an object of a type, if they include the object."""
    events = [frame for frame in facts if frame.action == action and _is_target_known(frame)]
    return [frame for frame in events if words is None or target_is(frame, words)]


def _is_target_known(frame: FrameFacts) -> bool:
    """Return True if the object acted on, or a slice of it, is among the known objects."""
    target = frame.target or ""
    return target in frame.objects or any(key.startswith(f"{target}|") for key in frame.objects)


def target_name(frame: FrameFacts) -> str:
    """Return the type of the object acted on, from its id: its last part for slices and basins."""
    parts = (frame.target or "").split("|")
    return plain_name(re.sub(r"_\d+$", "", parts[-1]) if len(parts) > 4 else parts[0])


def target_is(frame: FrameFacts, words: str) -> bool:
    """Return True if the object acted on is of the type that some words name."""
    return target_name(frame) == named_type(words)


def only_loose(frame: FrameFacts) -> FrameFacts:
    """Return the facts without fixtures in or on others; those without a parent are holders."""
    remaining = {
        key: state
        for key, state in frame.objects.items()
        if state.type in frame.loose or not state.parents
    }
    return replace(frame, objects=remaining)
