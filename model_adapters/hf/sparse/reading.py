"""Sparse attention of the one sequence that a model has encoded."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import Any

import torch
from torch import Tensor

from model_adapters.hf.cached.kv_cache import BufferedCache
from model_adapters.hf.prompting.prompt import Piece, n_tokens
from model_adapters.hf.sparse.chosen import ChosenAttention
from model_adapters.hf.sparse.interface import MaskFunction, Plan, attending, seen_by
from model_adapters.hf.sparse.layout import Layout
from model_adapters.hf.sparse.window import WindowAttention


@dataclass(eq=False)
class SparseReading:
    """How a sequence is read: which tokens see which, and what its cache need not keep.

    Attributes:
        config: config of the decoder.
        rule: which tokens see which.
        device: device of the decoder's inputs.
        by_frames: True if frames are seen, or not, as a whole.
    """

    config: Any
    rule: WindowAttention | ChosenAttention
    device: torch.device
    _: KW_ONLY
    by_frames: bool

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin a sequence."""
        self.layout = Layout.empty(self.device)

    @property
    def window(self) -> WindowAttention | None:
        """The rule, if it is one of all tokens, of replies too."""
        return self.rule if isinstance(self.rule, WindowAttention) else None

    @property
    def goes_by_chunks(self) -> bool:
        """True if what a token sees depends on those that it is encoded with."""
        return self.window is None

    def most_stored(self, n_tokens: int, chunk_tokens: int) -> int:
        """Return how many of so many tokens a cache keeps while they are read in chunks."""
        if self.window is None:
            return n_tokens
        return min(n_tokens, self.window.shape.sinks + self.window.shape.window + chunk_tokens)

    def cut_before(self, n_tokens: int) -> int:
        """Return the most tokens, of so many, behind which the sequence can be cut."""
        if self.window is None or n_tokens >= self.window.first_seen(self.layout):
            return n_tokens
        return 0

    def cut(self, n_tokens: int) -> None:
        """Keep the first tokens, as many as `cut_before` has."""
        self.layout = self.layout[self.layout.number < n_tokens]

    def drop_unseen(self, cache: BufferedCache, n_tokens: int) -> None:
        """Drop what no token behind so many sees."""
        if self.window is not None:
            begin = self.window.n_sinks(self.layout)
            end = begin + self.window.n_unseen(self.layout, n_tokens)
            cache.drop(begin, end)
            self.layout = self.layout[:begin] + self.layout[end:]

    @contextmanager
    def appended(
        self, pieces: Sequence[Piece], start: int, positions: Tensor, *, is_asked: bool
    ) -> Iterator[None]:
        """Attend this way within the context, in which the decoder is given more pieces once.

        Args:
            pieces: the pieces, of which the first token has the number `start`.
            start: tokens of the sequence before them.
            positions: positions of their tokens, (1, tokens) or (3, 1, tokens).
            is_asked: True behind the last frame: what is asked, and replies, see all keys where
                these are chosen for chunks.

        Raises:
            CannotAttendError: the decoder attends in another way; see `attending`.
        """
        self.layout += Layout.of(pieces, start, positions, by_frames=self.by_frames)
        if is_asked and self.goes_by_chunks:
            yield
            return

        def plan(mask_function: MaskFunction, _local_size: int | None) -> Plan:
            return self.rule.plan(self.layout, n_tokens(pieces), partial(seen_by, mask_function))

        with attending(self.config, self.device, plan, "leave attention out"):
            yield
