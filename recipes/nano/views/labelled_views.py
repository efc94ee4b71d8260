"""Views of rooms with what they show where, for training a vision tower: an `.npz` file per room.

| array | what it is |
|---|---|
| `frames` | uint8, [views, side, side, 3], RGB, top row first |
| `names` | names of object types, sorted |
| `view` | int32, [things], the view that shows a thing |
| `type` | int16, [things], index of its type in `names` |
| `receptacle` | int16, [things], index of the type of the innermost receptacle it is in, or -1 |
| `loose` | bool, [things], whether it can be picked up |
| `held`, `opened` | bool, [things], whether the agent holds it, and whether it is open |
| `pixels` | uint16, [things, grid, grid], its pixels in each cell of the frame as it was rendered |

A thing is an object in one view. Types have AI2-THOR's names.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import DAMAGED_ZIP
from infthor_eval.storage.files import write_atomically, writing_hint

_NONE = -1
_COLOURS = 3
_MALFORMED = (*DAMAGED_ZIP, ValueError, TypeError, MemoryError)
# Kinds of numpy's types, and dimensions; those of things have one row a thing.
_FORMS = {
    "frames": ("u", 4),
    "names": ("U", 1),
    "view": ("i", 1),
    "type": ("i", 1),
    "receptacle": ("i", 1),
    "loose": ("b", 1),
    "held": ("b", 1),
    "opened": ("b", 1),
    "pixels": ("u", 3),
}


class ThingInView(NamedTuple):
    """An object in a view.

    Attributes:
        view: index of the view.
        type: object type.
        receptacle: type of the innermost receptacle that it is in or on; None for none.
        loose: True if it can be picked up.
        held: True if the agent holds it.
        opened: True if it is open.
        pixels: its pixels in each cell of the frame, [grid, grid].
    """

    view: int
    type: str
    receptacle: str | None
    loose: bool
    held: bool
    opened: bool
    pixels: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LabelledViews:
    """Views with labels, as arrays; see the module."""

    frames: NDArray[np.uint8]
    names: NDArray[np.str_]
    view: NDArray[np.int32]
    type: NDArray[np.int16]
    receptacle: NDArray[np.int16]
    loose: NDArray[np.bool_]
    held: NDArray[np.bool_]
    opened: NDArray[np.bool_]
    pixels: NDArray[np.uint16]


def views_of(frames: Sequence[NDArray[np.uint8]], things: Sequence[ThingInView]) -> LabelledViews:
    """Return views of one size, at least one of which shows something."""
    types = {thing.type for thing in things} | {thing.receptacle for thing in things}
    names = sorted(name for name in types if name is not None)
    index: dict[str | None, int] = {name: at for at, name in enumerate(names)}
    index[None] = _NONE
    return LabelledViews(
        frames=np.stack(frames),
        names=np.array(names),
        view=np.array([thing.view for thing in things], np.int32),
        type=np.array([index[thing.type] for thing in things], np.int16),
        receptacle=np.array([index[thing.receptacle] for thing in things], np.int16),
        loose=np.array([thing.loose for thing in things], np.bool_),
        held=np.array([thing.held for thing in things], np.bool_),
        opened=np.array([thing.opened for thing in things], np.bool_),
        pixels=np.stack([thing.pixels for thing in things]).astype(np.uint16),
    )


def write_views(path: Path, views: LabelledViews) -> None:
    """Write views to a file; it is there when it is whole."""
    hint = writing_hint(" and run the same command again, which resumes")
    with (
        wrap_errors(f"{path}: cannot be written", hint),
        write_atomically(path) as partial,
        partial.open("wb") as file,
    ):
        np.savez_compressed(file, allow_pickle=False, **vars(views))


def read_views(path: Path) -> LabelledViews:
    """Read a file of views."""
    hint = "remove it, and run the command that made it again"
    with (
        wrap_errors(f"{path}: no labelled views", hint, catch=_MALFORMED),
        np.load(path) as arrays,
    ):
        views = LabelledViews(**arrays)
    problem = _problem(views)
    if problem:
        raise DataError(f"{path}: {problem}; {hint}")
    return views


def _problem(views: LabelledViews) -> str | None:
    """Return what is wrong with views, None for nothing."""
    for name, form in _FORMS.items():
        array = getattr(views, name)
        if (array.dtype.kind, array.ndim) != form:
            return f"its {name} are {array.dtype} of {array.ndim} dimensions"
    if views.frames.shape[3] != _COLOURS:
        return f"its frames have {views.frames.shape[3]} colours"
    n_things = len(views.view)
    columns = (
        *(views.type, views.receptacle, views.loose),
        *(views.held, views.opened, views.pixels),
    )
    if any(len(column) != n_things for column in columns):
        return "its columns have different lengths"
    n_names, n_views = len(views.names), len(views.frames)
    ranges = ((views.view, 0, n_views), (views.type, 0, n_names), (views.receptacle, -1, n_names))
    if any(((column < low) | (column >= high)).any() for column, low, high in ranges):
        return "it names a view or a type that it does not have"
    return None
