"""Vision features of frames, in a bounded cache."""

from collections import OrderedDict
from collections.abc import Sequence

import torch

from model_adapters.hf.family import Family
from model_adapters.hf.prompt import Frame

__all__ = ["FeatureCache"]


class FeatureCache:
    """Features by the digest of the frame's file; the least recently used are dropped first.

    The family computes missing ones. At most `max_bytes` are cached; 0 caches none.
    """

    def __init__(self, family: Family, max_bytes: int) -> None:
        self._family = family
        self._max_bytes = max_bytes
        self._bytes = 0
        self._cache: OrderedDict[str, torch.Tensor] = OrderedDict()

    @torch.inference_mode()
    def get(self, frames: Sequence[Frame]) -> list[torch.Tensor]:
        """Return the features of each frame, (slots, hidden), in order; missing ones are computed in one batch.

        Raises:
            DataError: a frame cannot be decoded.
        """
        requested = {frame.digest: frame for frame in frames}
        missing = [frame for digest, frame in requested.items() if digest not in self._cache]
        features = {digest: self._cache[digest] for digest in requested if digest in self._cache}
        if missing:
            tensors = self._family.features([frame.ref.load() for frame in missing])
            computed = {frame.digest: tensor for frame, tensor in zip(missing, tensors, strict=True)}
            features = computed | features
        self._store(features)
        return [features[frame.digest] for frame in frames]

    def clear(self) -> None:
        """Drop all features."""
        self._cache.clear()
        self._bytes = 0

    def _store(self, features: dict[str, torch.Tensor]) -> None:
        for digest, tensor in features.items():
            if digest not in self._cache:
                # A slice of a batch would keep the whole batch's memory as long as one of its frames is cached.
                self._cache[digest] = tensor.clone() if self._max_bytes else tensor
                self._bytes += tensor.nbytes
            self._cache.move_to_end(digest)
        while self._bytes > self._max_bytes:
            self._bytes -= self._cache.popitem(last=False)[1].nbytes
