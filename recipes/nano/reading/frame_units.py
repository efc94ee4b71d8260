"""Units of recorded frames: what the trained tower sees in them, computed once.

The tower takes most of a step's time, and is not trained any more when the decoder learns to read.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.prompting.prompt import Frame
from recipes.nano.seeing.units import Role, Units
from recipes.nano.tower import patch_states, unit_logits

_READER_THREADS = 2
_BATCH = 64  # frames in the tower at once
_OPEN = 3.0  # of the unit of something that is turned open


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

    Raises:
        DataError: a frame cannot be read, or is not square.
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
