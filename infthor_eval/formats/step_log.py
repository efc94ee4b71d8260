"""The log of a replayed trajectory: `metadata/<traj_id>/metadata.json`, one entry per frame.

Published data have four layouts (`Layout`), and all are read. In the last one `img_idx` is a list
of objects with `low_idx` and `img_filename`, as the loader of the branch `dev` reads it. Published
entries have `img_idx`, `img_filename`, `step` and `object_log`. Ours add optional fields for the
question rules and their checker, so that either kind of log can be read by either kind of reader.

Frame 0 shows the scene before the first action, frame k + 1 the outcome of low-level action k.
`step` is the index of that action. Frame 0 has step 0, as in the published logs, and no `action`.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import find_images
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.reading import NOT_JSON, decode_json, read_bytes, read_json

LOG = "metadata.json"
_HINT = "replay the trajectory again or restore the published file"


class Layout(StrEnum):
    """The layouts of published step logs."""

    LIST = "a list of entries"
    ENTRY = "one entry"
    COLUMNS = "columns"
    OBJECTS = "img_idx as objects"
    NONE = "frames alone"  # a folder of one's own (`own_folder`)


class ObjectLog(msgspec.Struct, omit_defaults=False):
    """What the simulator reports about objects at one frame, by object type (published fields).

    Attributes:
        visible: types of the visible objects (within the simulator's visibility distance).
        pickupable: types of the visible objects that can be picked up.
        is_open: types of the visible objects that are open.
        inven_obj: types of the objects in the agent's hand.
        receptacles: types of the visible receptacles.
        recep_objs: types of the visible objects in each visible receptacle, by the receptacle's
            type.
    """

    visible: list[str] = msgspec.field(default_factory=list)
    pickupable: list[str] = msgspec.field(default_factory=list)
    is_open: list[str] = msgspec.field(name="isOpen", default_factory=list)
    inven_obj: list[str] = msgspec.field(default_factory=list)
    receptacles: list[str] = msgspec.field(default_factory=list)
    recep_objs: dict[str, list[str]] = msgspec.field(default_factory=dict)


class LoggedPose(msgspec.Struct):
    """The agent's pose: position in metres, rotation about the vertical and horizon in degrees."""

    x: float
    y: float
    z: float
    rotation: float
    horizon: float


class ObjectInFrame(msgspec.Struct, omit_defaults=True):
    """One object instance as it appears in a frame.

    Attributes:
        pixels: number of the frame's pixels that show it.
        box: [xmin, ymin, xmax, ymax] of these pixels, both ends inclusive.
        visible: the simulator's flag, True if the object is in view and within the visibility
            distance.
        inside, top_inside: shares of its bounding box, and of the top quarter of it, that lie
            within the frame, whatever hides them.
    """

    pixels: int
    box: tuple[int, int, int, int]
    visible: bool = False
    inside: float = 1.0
    top_inside: float = 1.0


class ObjectState(msgspec.Struct, omit_defaults=True):
    """The true state of one object, whether it is in view or not.

    Attributes:
        type: AI2-THOR object type.
        parents: ids of the receptacles it is in or on; if they are nested, the innermost first.
        position: x, y, z in metres.
        held: True if it is in the agent's hand.
        exists: False after it left the scene (an egg that was cracked, a loaf that was sliced).
        is_open: True if it is open, None if it cannot be opened.
        is_on: True if it is switched on, None if it cannot be switched.
        is_sliced: True if it is sliced.
        is_dirty: True if it is dirty.
        is_cooked: True if it is cooked.
        temperature: "RoomTemp", "Hot" or "Cold".
    """

    type: str
    parents: tuple[str, ...] = ()
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    held: bool = False
    exists: bool = True
    is_open: bool | None = None
    is_on: bool | None = None
    is_sliced: bool = False
    is_dirty: bool = False
    is_cooked: bool = False
    temperature: str = "RoomTemp"


class Step(msgspec.Struct, omit_defaults=True):
    """One frame and its metadata.

    Attributes:
        img_idx: number of the frame.
        img_filename: name of the frame's file.
        step: index of the low-level action before the frame (see the module's docstring).
        object_log: the published fields.
        action: text of that action ("PickupObject Mug"); None at the first frame and in published
            logs.
        success: True if the simulator accepted the action.
        error: the simulator's message if it refused the action.
        high_idx: index of the sub-goal that the action belongs to.
        pose: the agent's pose; None in published logs.
        target: id of the object acted on.
        receptacle: id of the receptacle acted on.
        seen: object instances in the frame by id; None in published logs.
        changes: states, by id, of the objects that changed since the frame before; of all objects
            at the first frame.
        low_idx: `step` in the layout of `dev`, where it is null or 0 before the first action; None
            in the others.
    """

    img_idx: int
    img_filename: str
    step: int = 0
    object_log: ObjectLog = msgspec.field(default_factory=ObjectLog)
    action: str | None = None
    success: bool = True
    error: str | None = None
    high_idx: int | None = None
    pose: LoggedPose | None = None
    target: str | None = None
    receptacle: str | None = None
    seen: dict[str, ObjectInFrame] | None = None
    changes: dict[str, ObjectState] = msgspec.field(default_factory=dict)
    low_idx: int | None = None


_STEPS = msgspec.json.Decoder(list[Step])


def log_file(folder: SetPath) -> SetPath:
    """Return the file of the log of the trajectory in `metadata/<traj_id>`, if it has one."""
    return folder / LOG


def read_steps(folder: SetPath) -> list[Step]:
    """Read the log of the trajectory in `metadata/<traj_id>`: an entry a frame, in file order.

    A folder of frames alone, without a log, has an entry a frame that says only which it is.
    """
    path = log_file(folder)
    images = _unlogged_images(folder)
    if images:
        return [Step(index, image.name) for index, image in enumerate(images)]
    content = read_bytes(path, _HINT)
    with suppress(*NOT_JSON):  # else it is of another layout, or broken
        return _STEPS.decode(content)
    document = decode_json(content, path, _HINT)
    return [_step(path, index, entry) for index, entry in enumerate(_entries(path, document))]


def write_steps(folder: Path, steps: Sequence[Step]) -> None:
    """Write the log of a trajectory into its folder, which must exist: a list, an entry a line."""
    lines = b",\n".join(msgspec.json.encode(step) for step in steps)
    (Path(folder) / LOG).write_bytes(b"[\n" + lines + b"\n]\n")


def iter_object_states(steps: Sequence[Step]) -> Iterator[dict[str, ObjectState]]:
    """Yield the states of all objects, by id, at each step, from the changes in the log.

    It is one dict, updated in place: copy what must outlive the next step.
    """
    states: dict[str, ObjectState] = {}
    for step in steps:
        states.update(step.changes)
        yield states


def layout_of(folder: SetPath) -> Layout:
    """Return the layout of the log of the trajectory in `metadata/<traj_id>`."""
    if _unlogged_images(folder):
        return Layout.NONE
    path = log_file(folder)
    return _layout(path, read_json(path, _HINT))


def _unlogged_images(folder: SetPath) -> list[SetPath]:
    """Return the frames that are in a folder itself, if it has no log of them."""
    if log_file(folder).exists() or not folder.is_dir():
        return []
    return list(find_images(folder).values())


def _layout(path: SetPath, document: Any) -> Layout:
    if isinstance(document, list):
        return Layout.LIST
    if not isinstance(document, dict) or "img_idx" not in document:
        raise DataError(f"{path}: neither a list of entries nor columns with 'img_idx'; {_HINT}")
    frames = document["img_idx"]
    if not isinstance(frames, list):
        return Layout.ENTRY
    are_objects = bool(frames) and all(isinstance(frame, dict) for frame in frames)
    return Layout.OBJECTS if are_objects else Layout.COLUMNS


def _entries(path: SetPath, document: Any) -> list[dict[str, Any]]:
    """Return the entries of any layout as a list of dicts."""
    match _layout(path, document):
        case Layout.LIST:
            return list(document)
        case Layout.ENTRY:
            return [document]
        case Layout.COLUMNS:
            return _rows(path, document)
        case _:  # objects; frames alone have no document
            # The published code counts the sorted pictures, so a frame's number is its place among
            # their names.
            listed = enumerate(
                sorted(document["img_idx"], key=lambda frame: str(frame.get("img_filename")))
            )
            return [
                {"img_idx": index, "step": frame.get("low_idx") or 0, **frame}
                for index, frame in listed
            ]


def _rows(path: SetPath, columns: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of a dict of columns; values that are not lists are remarks, not columns."""
    lists = {name: column for name, column in columns.items() if isinstance(column, list)}
    n_rows = len(columns["img_idx"])
    for name, column in lists.items():
        if len(column) != n_rows:
            raise DataError(
                f"{path}: column '{name}' has {len(column)} entries, 'img_idx' has {n_rows}; "
                f"{_HINT}"
            )
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def _step(path: SetPath, index: int, entry: object) -> Step:
    if (
        isinstance(entry, dict)
        and "img_filename" not in entry
        and isinstance(entry.get("img_idx"), int)
    ):
        # Files of columns may lack the names; frame files are always named by their number.
        entry = {**entry, "img_filename": f"{entry['img_idx']:09d}.png"}
    try:
        return msgspec.convert(entry, Step)
    except msgspec.ValidationError as error:
        raise DataError(f"{path}: entry {index}: {error}; {_HINT}") from error
