"""Units of recorded frames: what the trained tower sees in them, computed once.

The tower takes most of a step's time, and is not trained any more when the decoder learns to read.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.prompting.prompt import Frame
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seen_objects import SeenFrame, SeenObject
from recipes.nano.tower import patch_states, unit_logits

_READER_THREADS = 2
_BATCH = 64  # frames in the tower at once
_OPEN = 3.0  # of the unit of something that is turned open
# A box is in a token's part of the picture if it has so large a share of the part, or of what it
# has in the part with most of it.
_OF_TOKEN = 0.4
_OF_LARGEST = 0.5
_LEAST_AREA = 60  # pixels of a box
# Units before their nonlinearity: off, and the range of those that are on.
_OFF = -9.0
_ON = (2.4, 4.0)


@dataclass(frozen=True)
class ChangedFrame(Frame):
    """A frame of a home that is told otherwise (`homes.Home`).

    Attributes:
        order: for each type of the units, the index of the type that it is in the frame as it was
            recorded; None for all as they are.
        turned: indices, in the frame as it was recorded, of types that are open where they are not.
    """

    order: tuple[int, ...] | None = field(default=None, repr=False)
    turned: tuple[int, ...] = field(default=(), repr=False)


@dataclass(frozen=True)
class FrameUnits:
    """Units of frames before their nonlinearity.

    Attributes:
        values: (frames, tokens, roles, types), float16.
        index: place of each frame by the digest of its file.
    """

    values: Tensor
    index: dict[str, int]

    def of(self, frame: Frame) -> Tensor:
        """Return the units of a frame, (tokens, roles, types), float32."""
        values = self.values[self.index[frame.digest]].float()
        if not isinstance(frame, ChangedFrame):
            return values
        _turn(values, frame.turned)
        return values if frame.order is None else values[..., list(frame.order)]


def _turn(values: Tensor, types: Sequence[int]) -> None:
    """Open what is closed, and close what is open, where it is shown at all."""
    columns = list(types)
    opened = values[:, Role.OPEN, columns]
    is_shown = values[:, Role.SHOWN, columns] > 0
    values[:, Role.OPEN, columns] = torch.where(is_shown, (-opened).clamp(max=_OPEN), opened)


def read_frame_units(
    frames: Sequence[FrameRef], image_processor: Any, tower: Any, units: Units
) -> FrameUnits:
    """Compute the units of frames.

    Args:
        frames: the frames, each once.
        image_processor: makes the inputs of the tower.
        tower: the trained tower.
        units: units of its merger.
    """

    def patches(frame: FrameRef) -> Tensor:
        return _patches(frame, image_processor)

    parts = []
    with ThreadPoolExecutor(_READER_THREADS) as readers, torch.no_grad():
        for batch in _batches(frames):
            states = patch_states(tower, torch.stack([*readers.map(patches, batch)]))
            logits = unit_logits(tower, states, len(units))
            parts.append(logits.reshape(len(batch), -1, len(Role), len(units.types)).half())
    return FrameUnits(torch.cat(parts), {frame.digest: at for at, frame in enumerate(frames)})


def _batches(frames: Sequence[FrameRef]) -> Iterator[Sequence[FrameRef]]:
    return (frames[at : at + _BATCH] for at in range(0, len(frames), _BATCH))


def _patches(frame: FrameRef, image_processor: Any) -> Tensor:
    """Return the patches of a frame in one of its two time steps, (patches, values)."""
    pixels: Tensor = image_processor(images=[frame.load()], return_tensors="pt")["pixel_values"]
    side = int(len(pixels) ** 0.5)
    if side**2 != len(pixels):
        raise DataError(f"{frame.path}: is not square; use square frames")
    return pixels.reshape(len(pixels), 3, 2, -1)[:, :, 0].reshape(len(pixels), -1)


def label_units(
    seen: Sequence[SeenFrame], units: Units, loose: NDArray[np.bool_], grid: int, seed: int
) -> FrameUnits:
    """Return the units of frames by what they show, as a tower without mistakes would see them.

    What to compare with what is learned in minutes from what frames do show, and not in hours from
    what a tower tells of them. So the decoder reads labels first.

    Args:
        seen: the frames, each once, with what they show.
        units: names of the units.
        loose: [types], True for the types of things that can be picked up.
        grid: tokens along each side of a frame.
        seed: seed of how much each unit is on.
    """
    shown = [
        (at, one)
        for at, (_, objects) in enumerate(seen)
        for one in objects
        if units.index(one.type) >= 0 and _area(one) >= _LEAST_AREA
    ]
    frame = np.array([at for at, _ in shown], np.int64)
    sizes = np.array([one.frame.size for one in seen], float).reshape(-1, 2)
    boxes = np.array([one.box for _, one in shown], float).reshape(-1, 4)
    is_in = _tokens(boxes, sizes[frame], grid)
    values = np.full((len(seen), grid**2, len(Role), len(units.types)), _OFF, np.float16)
    rng = np.random.default_rng(seed)
    for role, of_role in _types_by_role([one for _, one in shown], units, loose).items():
        thing, token = np.nonzero(is_in & (of_role >= 0)[:, None])
        values[frame[thing], token, role, of_role[thing]] = rng.uniform(*_ON, len(thing))
    places = {one.frame.digest: at for at, one in enumerate(seen)}
    return FrameUnits(torch.from_numpy(values), places)


def _area(one: SeenObject) -> int:
    left, top, right, bottom = one.box
    return (right - left + 1) * (bottom - top + 1)


def _types_by_role(
    objects: Sequence[SeenObject], units: Units, loose: NDArray[np.bool_]
) -> dict[Role, NDArray[np.int64]]:
    """Return for each role the index of the type that each object turns on in it, or -1."""
    own = np.array([units.index(one.type) for one in objects], np.int64)
    parent = np.array([units.index(one.parent) if one.parent else -1 for one in objects], np.int64)
    is_held = np.array([one.is_held for one in objects], bool)
    is_open = np.array([bool(one.is_open) for one in objects], bool)
    return {
        Role.SHOWN: own,
        Role.HELD: np.where(is_held, own, -1),
        Role.OPEN: np.where(is_open, own, -1),
        Role.AROUND: np.where(loose[own] & ~is_held, parent, -1),
    }


def _tokens(boxes: NDArray[np.float64], sizes: NDArray[np.float64], grid: int) -> NDArray[np.bool_]:
    """Return which tokens boxes are in, (boxes, tokens), the tokens row by row.

    Args:
        boxes: left, top, right and bottom in pixels, both ends inclusive, (boxes, 4).
        sizes: width and height of each box's frame in pixels, (boxes, 2).
        grid: tokens along each side.
    """
    step = (sizes / grid)[:, :, None]
    edges = np.arange(grid + 1) * step  # (boxes, across and down, edges)
    low, high = boxes[:, :2, None], boxes[:, 2:, None] + 1
    overlap = np.minimum(edges[:, :, 1:], high) - np.maximum(edges[:, :, :-1], low)
    columns, rows = (np.clip(overlap, 0, None) / step).swapaxes(0, 1)
    area = (rows[:, :, None] * columns[:, None, :]).reshape(-1, grid**2)  # in parts of a picture
    return (area >= _OF_TOKEN) | (area >= _OF_LARGEST * area.max(1, keepdims=True))
