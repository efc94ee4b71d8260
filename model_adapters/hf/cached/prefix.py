"""The sequence that a model has encoded: its KV cache and the pieces in it.

A new prompt is compared with the encoded pieces, the cache is cut behind the longest common prefix,
and only the rest is encoded. This is done in chunks, so that the activations of one chunk are the
most that a long prompt needs. Chunks attend to the cache, so the numbers differ from those of one
pass only by rounding.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import KW_ONLY, dataclass
from itertools import accumulate
from typing import Any

import torch

from model_adapters.hf.cached.kv_cache import BufferedCache, BufferedLayer, cache_arguments
from model_adapters.hf.family import Family
from model_adapters.hf.loading.rope import LengthRope
from model_adapters.hf.prompting.embedding import Embed
from model_adapters.hf.prompting.prompt import Piece, end_of_frames, n_tokens, token_ids, width
from model_adapters.hf.sparse.reading import SparseReading


@dataclass(eq=False)
class Prefix:
    """The one encoded sequence of a model.

    Attributes:
        model: a transformers model that takes what `embed` makes, `position_ids` and
            `cache_arguments`.
        family: family of the model.
        embed: prepares spans of prompts.
        chunk_tokens: most tokens of one forward pass (a larger frame is a chunk alone).
        rope: rotary embeddings of the model if their frequencies depend on the prompt's length,
            else None.
        storage: device of keys and values; the device of the weights where None.
        sparse: which tokens see which; all earlier ones where None.
        cache: keys and values of the sequence.
    """

    model: Any
    family: Family
    embed: Embed
    _: KW_ONLY
    chunk_tokens: int
    rope: LengthRope | None = None
    storage: torch.device | None = None
    sparse: SparseReading | None = None

    def __post_init__(self) -> None:
        self._rope_key = -1
        self.reset()

    def reset(self) -> None:
        """Drop the sequence and free its memory."""
        self.cache = BufferedCache(self.model.get_decoder().config, self.storage)
        self._pieces: list[Piece] = []
        self._ends: list[int] = []  # tokens up to the end of each piece
        # Position behind everything before each piece, and of the next token.
        self._starts: list[int] = [0]
        self._chunk_ends: list[int] = []  # pieces up to the end of each chunk before what is asked
        if self.sparse is not None:
            self.sparse.reset()

    @property
    def n_tokens(self) -> int:
        """Tokens in the sequence."""
        return self.tokens_in(self.n_pieces)

    @property
    def n_pieces(self) -> int:
        """Number of pieces in the sequence."""
        return len(self._pieces)

    def tokens_in(self, n_pieces: int) -> int:
        """Return the tokens of the first pieces."""
        return self._ends[n_pieces - 1] if n_pieces else 0

    def behind(self, n_pieces: int) -> int:
        """Return the position behind the first pieces."""
        return self._starts[n_pieces]

    @property
    def end(self) -> int:
        """Position of the next token."""
        return self._starts[-1]

    @contextmanager
    def extended(self, continuations: Sequence[Sequence[Piece]], reserve: int) -> Iterator[None]:
        """Let others append to the cache within the context, what these continuations and some more
        tokens need."""
        n_stored = self.cache.get_seq_length()
        self.cache.reserve(n_stored + sum(map(n_tokens, continuations)) + reserve)
        done = False
        try:
            yield
            done = True
        finally:
            if done:
                self.cache.truncate(self.n_tokens)
            else:  # some layers may have cached more than others
                self.reset()

    def n_common(self, pieces: Sequence[Piece]) -> int:
        """Return how many pieces the sequence and these begin with."""
        shared = 0
        for ours, theirs in zip(self._pieces, pieces, strict=False):
            if ours is not theirs and ours != theirs:
                break
            shared += 1
        return shared

    def rewind_to(self, pieces: Sequence[Piece]) -> int:
        """Cut the sequence behind its longest common prefix with these pieces, of which at least
        one is left to feed.

        The last piece is never shared: logits of the next token come only from feeding something.

        Returns:
            Number of shared pieces.
        """
        if self.rope is not None:
            self._set_rope(self.rope, pieces)
        shared = self.n_common(pieces[:-1])
        n_tokens = self.cache.cut_before(self.tokens_in(self._whole_chunks(pieces, shared)))
        if self.sparse is not None:
            n_tokens = self.sparse.cut_before(n_tokens)
        shared = bisect_right(self._ends, n_tokens, hi=shared)
        self.cut(shared)
        return shared

    def _whole_chunks(self, pieces: Sequence[Piece], shared: int) -> int:
        """Return how many of the shared pieces are encoded as they would be with these alone: as
        many as are in the same chunks, if that decides what tokens see."""
        if self.sparse is None or not self.sparse.goes_by_chunks:
            return shared
        shown = pieces[: self._n_shown(pieces)]
        ends = [*accumulate(len(chunk) for chunk in chunks(shown, self.chunk_tokens))]
        n_same = 0
        for ours, theirs in zip(self._chunk_ends, ends, strict=False):
            if ours != theirs or ours > shared:
                break
            n_same = ours
        is_asked = n_same == len(shown) and self._chunk_ends[-1:] in ([], [n_same])
        return shared if is_asked else n_same

    def _set_rope(self, rope: LengthRope, pieces: Sequence[Piece]) -> None:
        """Set the rotary frequencies for a prompt; a sequence encoded with others is dropped."""
        ids = torch.tensor(list(token_ids(pieces)))
        shapes = [piece.shape for piece in pieces if not isinstance(piece, int)]
        n_positions = int(self.family.positions(ids, shapes, 0).max()) + 1
        if rope.key(n_positions) != self._rope_key:
            self.reset()
            rope.set(n_positions)
            self._rope_key = rope.key(n_positions)

    def cut(self, n_pieces: int) -> None:
        """Keep the first `n_pieces` pieces."""
        del self._pieces[n_pieces:], self._ends[n_pieces:], self._starts[n_pieces + 1 :]
        self._chunk_ends = [end for end in self._chunk_ends if end <= n_pieces]
        self.cache.truncate(self.n_tokens)
        if self.sparse is not None:
            self.sparse.cut(self.n_tokens)

    def lengthen(self, n_tokens: int) -> None:
        """Take so many tokens of text as encoded behind the sequence, each like its last token: for
        measuring memory, not for replies."""
        self.cache.lengthen(n_tokens)
        ends = range(self.n_tokens + 1, self.n_tokens + n_tokens + 1)
        starts = range(self.end + 1, self.end + n_tokens + 1)
        self._pieces += [0] * n_tokens
        self._ends += ends
        self._starts += starts

    def feed(self, pieces: Sequence[Piece], reserve: int = 0) -> torch.Tensor:
        """Encode pieces behind the sequence.

        Args:
            pieces: pieces to append, at least one.
            reserve: tokens to be fed later, for which memory is allocated at once.

        Returns:
            Logits of the token that follows the last piece, (vocabulary,).
        """
        self.embed.expect(pieces)
        logits = None
        n_shown = 0
        if self._reads_in_parts:
            n_shown = max(0, self._n_shown([*self._pieces, *pieces]) - self.n_pieces)
        shown, asked = pieces[:n_shown], pieces[n_shown:]
        n_stored = self.n_tokens + n_tokens(shown)
        if self.sparse is not None:
            n_stored = self.sparse.most_stored(n_stored, self.chunk_tokens)
        self.cache.reserve(n_stored + n_tokens(asked) + reserve)
        for chunk in chunks(shown, self.chunk_tokens):
            if self.sparse is not None:
                self.sparse.drop_unseen(self.cache, self.n_tokens)
            logits = self._forward(chunk)
            self._chunk_ends.append(self.n_pieces)
        if shown:
            self.cache.mark()
        for chunk in chunks(asked, self.chunk_tokens):
            logits = self._forward(chunk, is_asked=True)
        if logits is None:
            raise ValueError("nothing to feed")
        return logits

    def step(self, tokens: Sequence[int]) -> torch.Tensor:
        """Encode tokens of a reply; return the logits of the next one, (vocabulary,)."""
        return self._forward(list(tokens), is_asked=True)

    @property
    def _reads_in_parts(self) -> bool:
        """True unless the cache can be cut anywhere, and gets all at once."""
        return self.cache.needs_marks or self.sparse is not None

    def _n_shown(self, prompt: Sequence[Piece]) -> int:
        """Return how many pieces of a prompt are up to its last frame, behind which prompts on the
        same frames differ; of a text that is read sparsely, those in whole chunks."""
        n = end_of_frames(prompt)
        if not n and self.sparse is not None:
            return len(prompt) // self.chunk_tokens * self.chunk_tokens
        return n

    @torch.inference_mode()
    def _forward(self, chunk: list[Piece], *, is_asked: bool = False) -> torch.Tensor:
        span = self.embed(chunk, self._starts[-1], self._pieces)
        attending = (
            nullcontext()
            if self.sparse is None
            else self.sparse.appended(chunk, self.n_tokens, span.positions, is_asked=is_asked)
        )
        done = False
        try:
            with attending:
                output = self.model(
                    **span.inputs,
                    position_ids=span.positions,
                    **cache_arguments(self.model, self.cache),
                    logits_to_keep=1,
                )
            done = True
        finally:
            if not done:  # some layers have cached the chunk and others have not
                self.reset()
        end = self.n_tokens
        for piece in chunk:
            end += width(piece)
            self._pieces.append(piece)
            self._ends.append(end)
        self._starts[-1:] = [*span.starts, span.end]
        return output.logits[0, -1]


def chunks(pieces: Sequence[Piece], chunk_tokens: int) -> Iterator[list[Piece]]:
    """Yield pieces in chunks of at most so many tokens; a larger frame is a chunk alone."""
    chunk: list[Piece] = []
    size = 0
    for piece in pieces:
        if chunk and size + width(piece) > chunk_tokens:
            yield chunk
            chunk = []
            size = 0
        chunk.append(piece)
        size += width(piece)
    if chunk:
        yield chunk


class PrefixStore:
    """Sequences that a model has encoded, within a limit of bytes; the longest unused go first.

    Args:
        make: makes an empty sequence.
        most_bytes: most bytes of keys and values of all of them; one is kept in any case.
    """

    def __init__(self, make: Callable[[], Prefix], most_bytes: int) -> None:
        self._make = make
        self._most_bytes = most_bytes
        self._stored: list[Prefix] = []  # the last used one last

    def clear(self) -> None:
        """Free the memory of all."""
        self._stored.clear()

    def encode(self, pieces: Sequence[Piece], *, exactly: bool) -> tuple[Prefix, int]:
        """Return a sequence that begins with these pieces, and how many were encoded already.

        Args:
            pieces: the pieces.
            exactly: True if it must end with them.
        """
        prefix = max(self._stored, key=lambda it: it.n_common(pieces), default=None)
        n_known = 0 if prefix is None else prefix.n_common(pieces)
        if prefix is None or (n_known < len(pieces) and n_known < prefix.n_pieces):
            prefix = self._make()  # another trajectory's stays as it is
            n_known = 0
        else:
            self._stored.remove(prefix)
        if n_known < len(pieces):
            prefix.feed(pieces[n_known:])
        elif exactly:
            prefix.cut(len(pieces))
        self._stored.append(prefix)
        while len(self._stored) > 1 and sum(map(_n_bytes, self._stored)) > self._most_bytes:
            del self._stored[0]
        return prefix, n_known


def _n_bytes(prefix: Prefix) -> int:
    layers = [layer for layer in prefix.cache.layers if isinstance(layer, BufferedLayer)]
    return sum(layer.n_bytes for layer in layers)
