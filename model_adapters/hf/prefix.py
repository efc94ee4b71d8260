"""The sequence that a model has encoded: its KV cache, and which pieces lie in it.

A new prompt is compared with what is there, the cache is cut behind the longest common prefix, and only the rest is
encoded, in chunks, so that a prefix of any length needs the activations of one chunk only.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import torch

from model_adapters.hf.embedding import Embedder
from model_adapters.hf.family import Family
from model_adapters.hf.kv_cache import BufferedCache
from model_adapters.hf.prompt import Frame, Piece, n_tokens, token_ids
from model_adapters.hf.rope import LengthRope

__all__ = ["Prefix"]


class Prefix:
    """The one encoded sequence of a model.

    Args:
        model: a transformers model that takes `inputs_embeds`, `position_ids` and `past_key_values`.
        family: its family.
        embed: embeds stretches of prompts.
        chunk_tokens: most tokens in one forward pass (a frame with more makes a chunk of its own).
        rope: the model's rotary embeddings where their frequencies depend on the prompt's length.
        storage: where keys and values are kept; beside the weights where None.
    """

    def __init__(
        self,
        model: Any,
        family: Family,
        embed: Embedder,
        *,
        chunk_tokens: int,
        rope: LengthRope | None = None,
        storage: torch.device | None = None,
    ) -> None:
        self._model = model
        self._family = family
        self._rope = rope
        self._rope_key = -1
        self._storage = storage
        self._embed = embed
        self._chunk_tokens = chunk_tokens
        self.reset()

    def reset(self) -> None:
        """Forget the sequence and free its memory."""
        self._cache = BufferedCache(self._storage)
        self._pieces: list[Piece] = []
        self._ends: list[int] = []  # tokens up to and with each piece
        self._starts: list[int] = [0]  # the position each piece starts at, and that of the next one

    @property
    def n_tokens(self) -> int:
        """Tokens encoded at present."""
        return self._ends[-1] if self._ends else 0

    @property
    def end(self) -> int:
        """The position that the next token takes."""
        return self._starts[-1]

    def spread(self, n_rows: int, n_more: int) -> BufferedCache:
        """A cache of its own with the sequence in each of several rows, and room for more tokens."""
        return self._cache.spread(n_rows, self.n_tokens + n_more)

    def rewind_to(self, pieces: Sequence[Piece]) -> int:
        """Cut the sequence behind the pieces it shares with the given ones, which must have one more to be fed.

        Returns:
            How many pieces are shared.
        """
        if self._rope is not None:
            self._set_rope(self._rope, pieces)
        shared = 0
        for ours, theirs in zip(self._pieces, pieces[:-1], strict=False):
            if ours is not theirs and ours != theirs:
                break
            shared += 1
        self.cut(shared)
        return shared

    def _set_rope(self, rope: LengthRope, pieces: Sequence[Piece]) -> None:
        """Set the frequencies for a prompt; what was encoded with others cannot be used for it."""
        ids = torch.tensor(list(token_ids(pieces)))
        sizes = [piece.size for piece in pieces if isinstance(piece, Frame)]
        n_positions = int(self._family.positions(ids, sizes, 0).max()) + 1
        if rope.key(n_positions) != self._rope_key:
            self.reset()
            rope.set(n_positions)
            self._rope_key = rope.key(n_positions)

    def cut(self, n_pieces: int) -> None:
        """Keep the first `n_pieces` pieces."""
        del self._pieces[n_pieces:], self._ends[n_pieces:], self._starts[n_pieces + 1 :]
        self._cache.truncate(self.n_tokens)

    def feed(self, pieces: Sequence[Piece], reserve: int = 0) -> torch.Tensor:
        """Encode pieces behind the sequence.

        Args:
            pieces: at least one.
            reserve: tokens that will be fed after them, to allocate memory for.

        Returns:
            Logits of the token that follows the last piece, (vocabulary,).

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes.
        """
        self._cache.reserve(self.n_tokens + n_tokens(pieces) + reserve)
        logits = None
        for chunk in self._chunks(pieces):
            logits = self._forward(chunk)
        if logits is None:
            raise ValueError("nothing to feed")
        return logits

    def _chunks(self, pieces: Sequence[Piece]) -> Iterator[list[Piece]]:
        chunk: list[Piece] = []
        size = 0
        for piece in pieces:
            width = 1 if isinstance(piece, int) else len(piece.ids)
            if chunk and size + width > self._chunk_tokens:
                yield chunk
                chunk, size = [], 0
            chunk.append(piece)
            size += width
        if chunk:
            yield chunk

    @torch.inference_mode()
    def _forward(self, chunk: list[Piece]) -> torch.Tensor:
        stretch = self._embed(chunk, self._starts[-1])
        done = False
        try:
            output = self._model(
                inputs_embeds=stretch.embeds[None],
                position_ids=stretch.positions,
                past_key_values=self._cache,
                use_cache=True,
                logits_to_keep=1,
            )
            done = True
        finally:
            if not done:  # some layers have the chunk and some have not: nothing of it can be used again
                self.reset()
        end = self.n_tokens
        for piece in chunk:
            end += 1 if isinstance(piece, int) else len(piece.ids)
            self._pieces.append(piece)
            self._ends.append(end)
        self._starts[-1:] = [*stretch.starts, stretch.end]
        return output.logits[0, -1]
