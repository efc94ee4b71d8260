"""Which tokens of a sequence a cache has."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from model_adapters.hf.prompting.prompt import Piece, width


@dataclass(frozen=True)
class Layout:
    """Tokens in order, some of a sequence; each attribute is (tokens,), of whole numbers.

    Attributes:
        number: number of the token in the sequence, from 0.
        first: number of the first token of what is seen or not seen as a whole: itself or, where
            frames are not cut, its frame.
        last: number of the last one.
        position: position of the token; of those on three axes the least.
        behind: position behind it and all before it.
    """

    number: Tensor
    first: Tensor
    last: Tensor
    position: Tensor
    behind: Tensor

    @classmethod
    def empty(cls, device: torch.device) -> "Layout":
        """Return one without tokens."""
        return cls(*(torch.empty(0, dtype=torch.long, device=device) for _ in fields(cls)))

    @classmethod
    def of(
        cls, pieces: Sequence[Piece], start: int, positions: Tensor, *, by_frames: bool
    ) -> "Layout":
        """Return the layout of pieces that begin at a number.

        Args:
            pieces: texts and frames.
            start: number of their first token.
            positions: their positions, (1, tokens) or (3, 1, tokens).
            by_frames: True if frames are seen as a whole.
        """
        widths = [*map(width, pieces)]
        device = positions.device
        number = torch.arange(start, start + sum(widths), device=device)
        first = last = number
        if by_frames:
            sizes = torch.tensor(widths, device=device)
            ends = start + sizes.cumsum(0)
            first = (ends - sizes).repeat_interleave(sizes)
            last = (ends - 1).repeat_interleave(sizes)
        axes = _axes(positions)
        behind = axes.amax(dim=0).cummax(dim=0).values + 1
        return cls(number, first, last, axes.amin(dim=0), behind)

    @classmethod
    def of_words(cls, number: Tensor, positions: Tensor) -> "Layout":
        """Return the layout of tokens of text with these numbers, of any sequences."""
        position = _axes(positions)[0]
        return cls(number, number, number, position, position + 1)

    def __len__(self) -> int:
        return len(self.number)

    def __getitem__(self, places: slice | Tensor) -> "Layout":
        """Return some of the tokens, by place or by a mask."""
        return Layout(*(getattr(self, field.name)[places] for field in fields(self)))

    def __add__(self, other: "Layout") -> "Layout":
        """Return these tokens and others behind them."""
        pairs = [(getattr(self, it.name), getattr(other, it.name)) for it in fields(self)]
        return Layout(*map(torch.cat, pairs))


def _axes(positions: Tensor) -> Tensor:
    """Return positions as (axes, tokens)."""
    return positions.reshape(-1, positions.shape[-1]).long()
