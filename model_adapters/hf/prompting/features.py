"""Vision features of frames and clips, in a bounded cache."""

from collections import OrderedDict
from collections.abc import Sequence

import torch

from model_adapters.hf.family import Family
from model_adapters.hf.prompting.prompt import Clip, Frame

__all__ = ["FeatureCache"]


class FeatureCache:
    """Features by the content of a frame or a clip; the least recently used are dropped first.

    The family computes missing ones. At most `max_bytes` are cached; 0 caches none.
    """

    def __init__(self, family: Family, max_bytes: int) -> None:
        self._family = family
        self._max_bytes = max_bytes
        self._bytes = 0
        self._cache: OrderedDict[Frame | Clip, torch.Tensor] = OrderedDict()

    @torch.inference_mode()
    def get(self, pieces: Sequence[Frame | Clip]) -> list[torch.Tensor]:
        """Return each piece's features, (slots, hidden), in order; computes missing ones together.

        Raises:
            DataError: a frame cannot be decoded.
        """
        requested = dict.fromkeys(pieces)
        missing = [piece for piece in requested if piece not in self._cache]
        features = {piece: self._cache[piece] for piece in requested if piece in self._cache}
        features = self._compute(missing) | features
        self._store(features)
        return [features[piece] for piece in pieces]

    def clear(self) -> None:
        """Drop all features."""
        self._cache.clear()
        self._bytes = 0

    def _compute(self, pieces: Sequence[Frame | Clip]) -> dict[Frame | Clip, torch.Tensor]:
        frames = [piece for piece in pieces if isinstance(piece, Frame)]
        clips = [piece for piece in pieces if isinstance(piece, Clip)]
        features: dict[Frame | Clip, torch.Tensor] = {}
        if frames:
            images = [frame.ref.load() for frame in frames]
            features |= zip(frames, self._family.features(images), strict=True)
        if clips and self._family.video is not None:
            videos = []
            for clip in clips:
                videos.append((clip.shape, [ref.load() for ref in clip.refs]))
            features |= zip(clips, self._family.video.features(videos), strict=True)
        return features

    def _store(self, features: dict[Frame | Clip, torch.Tensor]) -> None:
        for piece, tensor in features.items():
            if piece not in self._cache:
                # A slice of a batch would keep the whole batch's memory as long as one of its
                # frames is cached.
                self._cache[piece] = tensor.clone() if self._max_bytes else tensor
                self._bytes += tensor.nbytes
            self._cache.move_to_end(piece)
        while self._bytes > self._max_bytes:
            self._bytes -= self._cache.popitem(last=False)[1].nbytes
