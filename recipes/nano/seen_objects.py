"""What the frames of replayed sets show, for labels and for synthetic questions."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.step_log import (
    ObjectInFrame,
    ObjectState,
    iter_object_states,
    read_steps,
)
from infthor_eval.training.data import trajectory_names

# smallest object that counts as shown: a thousandth of a 300 x 300 frame, as in the questions
_LEAST_PIXELS = 90


class SeenObject(NamedTuple):
    """An object in a frame.

    Attributes:
        type: its type; that of the part or slice for "...|SinkBasin" and "...|AppleSliced_1".
        box: left, top, right and bottom of its pixels, both ends inclusive.
        is_shown: True if it is near enough to be visible in AI2-THOR's sense, and not tiny.
        parent: type of the innermost receptacle that it is in or on.
        is_held: True if it is in the agent's hand.
        is_open: True if it is open, None if it cannot be opened.
    """

    type: str
    box: tuple[int, int, int, int]
    is_shown: bool
    parent: str | None = None
    is_held: bool = False
    is_open: bool | None = None


class SeenFrame(NamedTuple):
    """A frame with the objects that it shows."""

    frame: FrameRef
    objects: tuple[SeenObject, ...]


def read_seen_frames(folders: Iterable[Path]) -> list[SeenFrame]:
    """Read the distinct frames of the folders of replayed sets."""
    frames: dict[str, SeenFrame] = {}
    for folder in folders:
        data = NiehSet(folder, needs_questions=False)
        for name in trajectory_names(data):
            steps = sorted(read_steps(data.folder(name)), key=lambda step: step.img_idx)
            if any(step.seen is None for step in steps):
                raise DataError(
                    f"{data.folder(name)}: does not list the objects in its frames; replay the "
                    "trajectory"
                )
            # The states are one mapping that is brought up to date for each step.
            for frame, step, states in zip(
                data.frames(name), steps, iter_object_states(steps), strict=True
            ):
                if frame.digest not in frames:
                    frames[frame.digest] = SeenFrame(frame, _objects(step.seen or {}, states))
    return list(frames.values())


def _objects(
    seen: Mapping[str, ObjectInFrame], states: Mapping[str, ObjectState]
) -> tuple[SeenObject, ...]:
    return tuple(_object(key, instance, states.get(key)) for key, instance in seen.items())


def _object(key: str, instance: ObjectInFrame, state: ObjectState | None) -> SeenObject:
    is_shown = instance.visible and instance.pixels >= _LEAST_PIXELS
    seen = SeenObject(object_type_of(key), instance.box, is_shown)
    if state is None:
        return seen
    parent = object_type_of(state.parents[0]) if state.parents else None
    return seen._replace(parent=parent, is_held=state.held, is_open=state.is_open)
