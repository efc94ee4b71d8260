"""Facts of frames, for the independent check of questions, and how to read them.

They share no code with the rules, so they do not share their errors; they share the table of sizes.
Facts of the whole log have the logged actions. Facts of clue frames have only what pictures show:
an object in the hand was picked up, slices were cut, a light is on; only two successive frames show
that something was put (in the hand in the first, elsewhere in the second) or opened.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states
from infthor_eval.generation.questions.history import SHARE_FACTOR

_FRAME_PIXELS = 300 * 300


@dataclass(frozen=True)
class FactEvent:
    """An action on an object.

    Attributes:
        action: name of the action.
        target: id of the object.
        frame: facts of the frame after it.
    """

    action: str
    target: str
    frame: "FrameFacts"


@dataclass(frozen=True)
class FrameFacts:
    """What is known at one frame.

    Attributes:
        number: number of the frame.
        logged: name of the successful action before it and id of the object acted on; None if there
            is none, and in facts of clue frames.
        objects: states of the known objects by id.
        in_frame: ids of all objects in the frame, however small.
        everything: True if `objects` has all objects, False if only those in the frame.
        loose: types that can be picked up, which is general knowledge and not restricted to the
            frame.
    """

    number: int
    logged: tuple[str, str] | None
    objects: dict[str, ObjectState]
    in_frame: frozenset[str]
    everything: bool
    loose: frozenset[str]


def frame_facts(steps: Sequence[Step]) -> list[FrameFacts]:
    """Return the facts of the whole log, a frame each."""
    loose = frozenset(name for step in steps for name in step.object_log.pickupable)
    facts = []
    for step, states in zip(steps, iter_object_states(steps), strict=True):
        logged = None
        if step.success and step.action is not None and step.target is not None:
            logged = step.action.split(" ")[0], step.target
        facts.append(
            FrameFacts(
                number=step.img_idx,
                logged=logged,
                objects={key: state for key, state in states.items() if state.exists},
                in_frame=frozenset(step.seen or {}),
                everything=True,
                loose=loose,
            )
        )
    return facts


def facts_shown(
    steps: Sequence[Step], facts: Sequence[FrameFacts], share: float
) -> list[FrameFacts]:
    """Return what each frame shows of the log's facts: objects that fill this share of it."""
    return [
        replace(whole, objects=_large_objects(step, whole, share), logged=None, everything=False)
        for step, whole in zip(steps, facts, strict=True)
    ]


def _large_objects(step: Step, facts: FrameFacts, share: float) -> dict[str, ObjectState]:
    seen = step.seen or {}
    smallest = share * _FRAME_PIXELS
    return {
        key: state
        for key, state in facts.objects.items()
        if key in seen and seen[key].pixels >= smallest * SHARE_FACTOR.get(state.type, 1.0)
    }


@cache
def plain_name(object_type: str) -> str:
    """Return a type as answers have it: in small letters, and a basin as its whole."""
    return object_type.lower().replace(" ", "").removesuffix("basin")


@cache
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
) -> list[FactEvent]:
    """Return the known actions of this name, on objects of the type that some words name."""
    events = _logged_events(facts) if facts[0].everything else _events_shown(facts)
    return [
        event
        for event in events
        if event.action == action
        and (words is None or type_of_id(event.target) == named_type(words))
    ]


def _logged_events(facts: Sequence[FrameFacts]) -> list[FactEvent]:
    return [FactEvent(*frame.logged, frame) for frame in facts if frame.logged is not None]


def _events_shown(facts: Sequence[FrameFacts]) -> list[FactEvent]:
    """Return the actions that pictures show, in order of the frames."""
    events = []
    for previous, frame in pairwise([None, *facts]):
        assert frame is not None
        events += [FactEvent(*event, frame) for event in _results_shown(frame)]
        if previous is not None and frame.number == previous.number + 1:
            events += [FactEvent(*event, frame) for event in _changes_shown(previous, frame)]
    return events


def _results_shown(frame: FrameFacts) -> list[tuple[str, str]]:
    """Return the actions, with their objects, whose results one frame shows."""
    events = []
    for key, state in frame.objects.items():
        if state.held:
            events.append(("PickupObject", key))
        if state.is_on:
            events.append(("ToggleObjectOn", key))
        if state.type.endswith("Sliced"):
            events.append(("SliceObject", key.rpartition("|")[0]))
    return list(dict.fromkeys(events))


def _changes_shown(previous: FrameFacts, frame: FrameFacts) -> list[tuple[str, str]]:
    """Return the actions, with their objects, that two successive frames show."""
    events = []
    for key in previous.objects.keys() & frame.objects.keys():
        before = previous.objects[key]
        after = frame.objects[key]
        if before.held and not after.held:
            events.append(("PutObject", key))
        if after.is_open and before.is_open is False:
            events.append(("OpenObject", key))
    return sorted(events)


def type_of_id(key: str) -> str:
    """Return the type in an object's id as answers have it: the last part of slices and basins."""
    parts = key.split("|")
    return plain_name(re.sub(r"_\d+$", "", parts[-1]) if len(parts) > 4 else parts[0])


def only_loose(frame: FrameFacts) -> FrameFacts:
    """Return the facts without fixtures in or on others; those without a parent are holders."""
    remaining = {
        key: state
        for key, state in frame.objects.items()
        if state.type in frame.loose or not state.parents
    }
    return replace(frame, objects=remaining)
