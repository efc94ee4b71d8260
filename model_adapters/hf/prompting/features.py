"""Vision features of frames and clips, in a bounded cache."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import torch

from model_adapters.hf.family import ClipShape, Pixels
from model_adapters.hf.prompting.ahead import PixelsAhead
from model_adapters.hf.prompting.hashing import hash_frames
from model_adapters.hf.prompting.prompt import Clip, Frame


class _Kept(Protocol):
    @property
    def nbytes(self) -> int: ...

    def clone(self) -> Self: ...


_FilmedClip = tuple[ClipShape, Pixels]
T = TypeVar("T", bound=_Kept)


@dataclass(eq=False)
class FeatureCache(Generic[T]):
    """Features by the content of a frame or a clip; the least recently used are dropped first.

    Attributes:
        pixels: reads and scales frames and clips.
        compute_frames: returns the features of frames.
        max_bytes: most bytes that are cached; 0 caches none.
        compute_clips: returns the features of clips, for families with a video input.
    """

    pixels: PixelsAhead
    compute_frames: Callable[[Sequence[Pixels]], list[T]]
    max_bytes: int
    compute_clips: Callable[[Sequence[_FilmedClip]], list[T]] | None = None

    def __post_init__(self) -> None:
        self._bytes = 0
        self._cache: OrderedDict[Frame | Clip, T] = OrderedDict()

    @torch.inference_mode()
    def get(self, pieces: Sequence[Frame | Clip]) -> list[T]:
        """Return each piece's features, (slots, hidden), in order; computes missing ones
        together."""
        requested = dict.fromkeys(pieces)
        missing = [piece for piece in requested if piece not in self._cache]
        features = {piece: self._cache[piece] for piece in requested if piece in self._cache}
        features = self._compute(missing) | features
        self._store(features)
        return [features[piece] for piece in pieces]

    def expect(self, pieces: Sequence[Frame | Clip]) -> None:
        """Begin to read those pieces that are going to be asked for and are not cached."""
        self.pixels.expect([piece for piece in pieces if piece not in self._cache])

    def hash(self, pieces: Sequence[Frame | Clip]) -> str:
        """Return the hash of the pixels of pieces whose features were asked for."""
        return hash_frames(self.pixels.hashes[piece] for piece in pieces)

    def clear(self) -> None:
        """Drop all features."""
        self._cache.clear()
        self._bytes = 0

    def close(self) -> None:
        """End the threads that read frames."""
        self.pixels.close()

    def _compute(self, pieces: Sequence[Frame | Clip]) -> dict[Frame | Clip, T]:
        frames = [piece for piece in pieces if isinstance(piece, Frame)]
        clips = [piece for piece in pieces if isinstance(piece, Clip)]
        features: dict[Frame | Clip, T] = {}
        if frames:
            pixels = [self.pixels.take(frame) for frame in frames]
            features |= zip(frames, self.compute_frames(pixels), strict=True)
        if clips and self.compute_clips is not None:
            videos = [(clip.shape, self.pixels.take(clip)) for clip in clips]
            features |= zip(clips, self.compute_clips(videos), strict=True)
        return features

    def _store(self, features: dict[Frame | Clip, T]) -> None:
        for piece, tensor in features.items():
            if piece not in self._cache:
                # A slice of a batch would keep the whole batch's memory as long as one of its
                # frames is cached.
                self._cache[piece] = tensor.clone() if self.max_bytes else tensor
                self._bytes += tensor.nbytes
            self._cache.move_to_end(piece)
        while self._bytes > self.max_bytes:
            self._bytes -= self._cache.popitem(last=False)[1].nbytes
