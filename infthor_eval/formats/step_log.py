"""The log of a replayed trajectory: `metadata/<traj_id>/metadata.json`, one entry per frame.

Three layouts are in circulation and all are read: a list of entries, a single entry, and a dict of columns.
Entries as published hold `img_idx`, `img_filename`, `step` and `object_log`; ours add what question rules
and their checker need. The added fields are optional, so published logs read as well, and readers that
know only the published fields can read ours.

Frames and actions: frame 0 shows the scene before the first action, frame k + 1 the outcome of low-level
action k. `step` is that action's index; frame 0 carries step 0, as in the published logs, and `action`
None.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.reading import read_json

__all__ = [
    "LoggedPose",
    "ObjectInFrame",
    "ObjectLog",
    "ObjectState",
    "Step",
    "iter_object_states",
    "read_steps",
    "write_steps",
]

_FILE = "metadata.json"
_HINT = "replay the trajectory again or restore the published file"


class ObjectLog(msgspec.Struct, omit_defaults=False):
    """What the simulator reports of the objects at one frame, by object type (the published fields).

    Attributes:
        visible: types of the visible objects (within the simulator's visibility distance).
        pickupable: those of them that can be picked up.
        is_open: those of them that are open.
        inven_obj: types of the objects in the agent's hand.
        receptacles: types of the visible receptacles.
        recep_objs: receptacle type to the types of the visible objects in it.
    """

    visible: list[str] = msgspec.field(default_factory=list)
    pickupable: list[str] = msgspec.field(default_factory=list)
    is_open: list[str] = msgspec.field(name="isOpen", default_factory=list)
    inven_obj: list[str] = msgspec.field(default_factory=list)
    receptacles: list[str] = msgspec.field(default_factory=list)
    recep_objs: dict[str, list[str]] = msgspec.field(default_factory=dict)


class LoggedPose(msgspec.Struct):
    """Where the agent is: position in metres, rotation about the vertical and camera horizon in degrees."""

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
        visible: whether the simulator calls it visible, that is in sight and within its visibility distance.
    """

    pixels: int
    box: tuple[int, int, int, int]
    visible: bool = False


class ObjectState(msgspec.Struct, omit_defaults=True):
    """The true state of one object, seen or not.

    Attributes:
        type: AI2-THOR object type.
        parents: ids of the receptacles it is in or on, innermost first where nested.
        position: x, y, z in metres.
        held: whether it is in the agent's hand.
        exists: False from the step on at which it left the scene (an egg that was cracked, a loaf that was
            sliced).
        is_open, is_on: None where it cannot be opened or switched.
        is_sliced, is_dirty, is_cooked: False where it cannot be.
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
    """One frame and what holds at it.

    Attributes:
        img_idx: number of the frame.
        img_filename: name of the frame's file.
        step: index of the low-level action that led to it (see the module's text).
        object_log: the published fields.
        action: text of that action ("PickupObject Mug"); None at the first frame and in published logs.
        success: whether the simulator carried it out.
        error: the simulator's message where it did not.
        high_idx: index of the sub-goal that the action belongs to.
        pose: where the agent stands; None in published logs.
        target: id of the object acted on.
        receptacle: id of the receptacle acted on.
        seen: the object instances in the frame by id; None in published logs.
        changes: the state of every object that changed since the frame before, by id; of all objects at the
            first.
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


def read_steps(folder: Path) -> list[Step]:
    """Read the log of one trajectory.

    Args:
        folder: the trajectory's folder, `metadata/<traj_id>`.

    Returns:
        One entry per frame, in the order of the file.

    Raises:
        DataError: the file is missing, not JSON, or not in one of the known layouts.
    """
    path = Path(folder) / _FILE
    document = read_json(path, _HINT)
    return [_step(path, index, entry) for index, entry in enumerate(_entries(path, document))]


def write_steps(folder: Path, steps: Sequence[Step]) -> None:
    """Write the log of one trajectory as a list of entries, one a line.

    Args:
        folder: the trajectory's folder, which must exist.
        steps: one entry per frame.
    """
    lines = b",\n".join(msgspec.json.encode(step) for step in steps)
    (Path(folder) / _FILE).write_bytes(b"[\n" + lines + b"\n]\n")


def iter_object_states(steps: Sequence[Step]) -> Iterator[dict[str, ObjectState]]:
    """The state of all objects at each step, from the changes that the log holds.

    Yields:
        Per step one dict by object id. It is updated in place: copy what must outlive the next step.
    """
    world: dict[str, ObjectState] = {}
    for step in steps:
        world.update(step.changes)
        yield world


def _entries(path: Path, document: object) -> list[dict[str, Any]]:
    """The entries of any of the three layouts as a list of dicts."""
    if isinstance(document, list):
        return document
    if not isinstance(document, dict) or "img_idx" not in document:
        raise DataError(f"{path}: neither a list of entries nor columns with 'img_idx'; {_HINT}")
    if not isinstance(document["img_idx"], list):
        return [document]
    return _rows(path, document)


def _rows(path: Path, columns: dict[str, Any]) -> list[dict[str, Any]]:
    """Columns to rows; columns that are no lists (free remarks) are not per frame and stay out."""
    lists = {name: column for name, column in columns.items() if isinstance(column, list)}
    wanted = len(columns["img_idx"])
    for name, column in lists.items():
        if len(column) != wanted:
            raise DataError(f"{path}: column '{name}' has {len(column)} entries, 'img_idx' has {wanted}; {_HINT}")
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def _step(path: Path, index: int, entry: object) -> Step:
    if isinstance(entry, dict) and "img_filename" not in entry and isinstance(entry.get("img_idx"), int):
        # Columnar files may hold img_idx alone; frame files are always named by their number.
        entry = {**entry, "img_filename": f"{entry['img_idx']:09d}.png"}
    try:
        return msgspec.convert(entry, Step)
    except msgspec.ValidationError as error:
        raise DataError(f"{path}: entry {index}: {error}; {_HINT}") from error
