"""Vision features of frames, each computed once while they stay in a bounded cache."""

from collections import OrderedDict
from collections.abc import Sequence

import torch

from model_adapters.hf.family import Family
from model_adapters.hf.prompt import Frame

__all__ = ["FeatureCache"]


class FeatureCache:
    """Features by the digest of the frame's file, the least recently used dropped first.

    Args:
        family: computes what is missing.
        max_bytes: memory for features that nobody asks for at the moment; 0 keeps none.
    """

    def __init__(self, family: Family, max_bytes: int) -> None:
        self._family = family
        self._max_bytes = max_bytes
        self._bytes = 0
        self._kept: OrderedDict[str, torch.Tensor] = OrderedDict()

    @torch.inference_mode()
    def get(self, frames: Sequence[Frame]) -> list[torch.Tensor]:
        """Features of each frame, (slots, hidden), in the order asked for; the missing ones in one batch.

        Raises:
            DataError: a frame cannot be decoded.
        """
        wanted = {frame.digest: frame for frame in frames}
        missing = [frame for digest, frame in wanted.items() if digest not in self._kept]
        made: dict[str, torch.Tensor] = {}
        if missing:
            tensors = self._family.features([frame.ref.load() for frame in missing])
            made = {frame.digest: tensor for frame, tensor in zip(missing, tensors, strict=True)}
        found = made | {digest: self._kept[digest] for digest in wanted if digest not in made}
        self._keep(found)
        return [found[frame.digest] for frame in frames]

    def clear(self) -> None:
        """Drop everything."""
        self._kept.clear()
        self._bytes = 0

    def _keep(self, found: dict[str, torch.Tensor]) -> None:
        for digest, tensor in found.items():
            if digest not in self._kept:
                # A slice of a batch would hold the whole batch's memory for as long as one of its frames lives.
                self._kept[digest] = tensor.clone() if self._max_bytes else tensor
                self._bytes += tensor.nbytes
            self._kept.move_to_end(digest)
        while self._bytes > self._max_bytes:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes
