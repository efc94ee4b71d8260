"""Which object each pixel of a frame shows."""

from dataclasses import dataclass
from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError, wrap_errors


@dataclass(frozen=True)
class Instance:
    """The pixels that show an object: number, and [xmin, ymin, xmax, ymax], ends inclusive."""

    pixels: int
    box: tuple[int, int, int, int]


class _Color(msgspec.Struct, frozen=True):
    name: str
    color: tuple[int, int, int]

    @property
    def code(self) -> int:
        r, g, b = self.color
        return r << 16 | g << 8 | b


class Segmentation:
    """Which object each pixel of a frame shows; worked out when it is first asked for.

    Args:
        frame: the color of what each pixel shows, [height, width, 3].
        colors: AI2-THOR's `colors` in MessagePack: what has each color.
    """

    def __init__(self, frame: NDArray[np.uint8], colors: msgspec.Raw) -> None:
        self._frame = frame
        self._colors = colors

    @cached_property
    def codes(self) -> NDArray[np.uint32]:
        """A code for each pixel, [height, width]."""
        # In place, channel by channel: copies of the whole frame take four times as long.
        codes = self._frame[..., 0].astype(np.uint32)
        for channel in (1, 2):
            codes <<= 8
            codes |= self._frame[..., channel]
        return codes

    @cached_property
    def names(self) -> dict[int, str]:
        """Ids of objects by code; codes of walls and floors have none."""
        hint = "use AI2-THOR 5.x"
        with wrap_errors("colors of a reply", hint, catch=ValueError, raise_as=SimulatorError):
            colors = msgspec.msgpack.decode(self._colors, type=list[_Color])
        # A name without "|" is a class of the structure, not an object.
        return {it.code: it.name for it in colors if "|" in it.name}

    @cached_property
    def instances(self) -> dict[str, Instance]:
        """The objects in the frame by id."""
        return {
            self.names[code]: instance
            for code, instance in instances_of(self.codes).items()
            if code in self.names
        }


def instances_of(codes: NDArray[np.uint32]) -> dict[int, Instance]:
    """Return each code's number of pixels and box, given a code per pixel [height, width]."""
    width = codes.shape[1]
    # This works on runs of equal pixels within a row, of which there are a few thousand instead of
    # 90,000 pixels.
    starts = np.empty(codes.shape, dtype=bool)
    starts[:, 0] = True
    np.not_equal(codes[:, 1:], codes[:, :-1], out=starts[:, 1:])
    first = np.flatnonzero(starts)
    length = np.diff(first, append=codes.size)
    values, index = np.unique(codes.ravel()[first], return_inverse=True)
    row, left = np.divmod(first, width)
    pixels = np.bincount(index, weights=length).astype(int)
    low = np.full((len(values), 2), codes.size)
    high = np.zeros((len(values), 2), dtype=int)
    np.minimum.at(low, index, np.stack([left, row], axis=1))
    np.maximum.at(high, index, np.stack([left + length - 1, row], axis=1))
    boxes = np.concatenate([low, high], axis=1).tolist()
    return {
        int(code): Instance(int(count), (box[0], box[1], box[2], box[3]))
        for code, count, box in zip(values, pixels, boxes, strict=True)
    }
