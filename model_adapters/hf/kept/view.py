"""An encoded sequence as a method sees it that cuts its cache."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import torch
from torch import Tensor

from model_adapters.hf.cached.kv_cache import BufferedCache, BufferedLayer
from model_adapters.hf.cached.prefix import Prefix
from model_adapters.hf.prompting.prompt import Piece, n_tokens, width
from model_adapters.protocols import CacheCut


@dataclass
class CacheView:
    """Tokens of a sequence from the first frame on, as a method sees them.

    Attributes:
        cache: keys and values of the sequence.
        begin: tokens before the first frame, which are kept in any case.
        n_tokens: tokens behind these.
        n_frames: frames among them.
        budget: most tokens of frames that are kept for each head.
        frames: number of each token's frame, (tokens,); of marks that of the frame that they begin
            or end, which may be the last one's.
        is_frame: which of them are a frame's own, and not marks, (tokens,).
        chosen: numbers of the frames that are kept, if these were chosen; None if not.
        attention: how much the question attends to each token of the sequence, by layer, the mean
            of its tokens and of heads that share a key head; of methods that say `asks`.
    """

    cache: BufferedCache
    begin: int
    n_tokens: int
    n_frames: int
    budget: int
    frames: Tensor
    is_frame: Tensor
    chosen: Sequence[int] | None
    attention: list[Tensor] = field(default_factory=list)

    @classmethod
    def of(
        cls, prefix: Prefix, pieces: Sequence[Piece], n_opening: int, cut: CacheCut
    ) -> "CacheView":
        """Return the view of the first pieces of a sequence, of which some are before frames."""
        begin = n_tokens(pieces[:n_opening])
        shown = pieces[n_opening:]
        owners = owners_of(shown)
        widths = torch.tensor([*map(width, shown)], dtype=torch.long)
        is_frame = torch.tensor([not isinstance(piece, int) for piece in shown], dtype=torch.bool)
        frames = torch.tensor(owners, dtype=torch.long).repeat_interleave(widths)
        layers = prefix.cache.layers
        device = layers[0].keys.device if layers else frames.device
        n = len(frames)
        return cls(
            cache=prefix.cache,
            begin=begin,
            n_tokens=n,
            n_frames=int(is_frame.sum()),
            budget=n if cut.budget is None else min(cut.budget, n),
            frames=frames.to(device),
            is_frame=is_frame.repeat_interleave(widths).to(device),
            chosen=cut.frames,
        )

    def keys(self, layer: int) -> Tensor:
        """Return a layer's keys, turned to their positions: (key heads, tokens, head size)."""
        return self._states(layer).keys[0, :, self.begin : self.begin + self.n_tokens]

    def values(self, layer: int) -> Tensor:
        """Return a layer's values, likewise."""
        return self._states(layer).values[0, :, self.begin : self.begin + self.n_tokens]

    def asked(self, layer: int) -> Tensor:
        """Return how much the question attends to each token, (key heads, tokens)."""
        return self.attention[layer][:, self.begin : self.begin + self.n_tokens]

    def opening(self, layer: int) -> tuple[Tensor, Tensor]:
        """Return keys and values of what is before the first frame."""
        states = self._states(layer)
        return states.keys[0, :, : self.begin], states.values[0, :, : self.begin]

    def _states(self, layer: int) -> BufferedLayer:
        states = self.cache.layers[layer]
        assert isinstance(states, BufferedLayer)
        return states


def owners_of(pieces: Sequence[Piece]) -> list[int]:
    """Return the number of each piece's frame; of marks between two frames half are of either."""
    places = [at for at, piece in enumerate(pieces) if not isinstance(piece, int)]
    owners: list[int] = []
    for number, (at, following) in enumerate(pairwise([*places, len(pieces)])):
        n_own = 1 + -(-(following - at - 1) // 2)
        owners += [number] * n_own + [number + 1] * (following - at - n_own)
    return owners
