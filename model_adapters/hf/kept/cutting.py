"""Cutting the cache of an encoded sequence, and standing for it when questions follow."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pkgutil import resolve_name
from statistics import fmean
from typing import NamedTuple

import torch
from torch import Tensor

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.kv_cache import BufferedCache
from model_adapters.hf.cached.prefix import Prefix
from model_adapters.hf.kept.methods import CacheMethod
from model_adapters.hf.kept.view import CacheView
from model_adapters.hf.prompting.prompt import Piece, n_tokens
from model_adapters.hf.sparse.interface import attending, by_mask
from model_adapters.protocols import CacheCut, KeptCache


def method_of(cut: CacheCut) -> CacheMethod:
    """Return the method of a cut.

    Raises:
        ModelError: it cannot be imported.
    """
    try:
        method: CacheMethod = resolve_name(cut.method)()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise ModelError(f"the method {cut.method} of a cache cannot be made ({error})") from error
    return method


def split_at_last_frame(pieces: Sequence[Piece]) -> tuple[int, int]:
    """Return how many pieces there are before the first frame, and before the last one.

    Raises:
        ModelError: there is no frame.
    """
    places = [at for at, piece in enumerate(pieces) if not isinstance(piece, int)]
    if not places:
        raise ModelError("a cache that is cut needs frames; leave the memory out")
    return places[0], places[-1]


class Behind(NamedTuple):
    """Prompts on the same frames before the last one.

    Attributes:
        numbers: which of the prompts.
        before: their pieces before the last frame.
        n_opening: how many of these are before the first one.
        afters: the other pieces of each.
    """

    numbers: list[int]
    before: Sequence[Piece]
    n_opening: int
    afters: list[Sequence[Piece]]


def grouped(prompts: Sequence[Sequence[Piece]], *, together: bool) -> Iterator[Behind]:
    """Yield prompts by what is cut: neighbours on the same frames together, or each by itself."""
    group: Behind | None = None
    for number, prompt in enumerate(prompts):
        opening, last = split_at_last_frame(prompt)
        if group is None or not together or prompt[:last] != group.before:
            if group is not None:
                yield group
            group = Behind([], prompt[:last], opening, [])
        group.numbers.append(number)
        group.afters.append(prompt[last:])
    if group is not None:
        yield group


class CutPrefix:
    """What is kept of a sequence, in place of its `Prefix` for what follows.

    Attributes:
        model, embed, chunk_tokens: those of the sequence.
        cache: the keys and values that are kept.
        kept: how much that is.
        sparse: None: what follows sees all of it.
    """

    sparse = None

    @torch.inference_mode()
    def __init__(self, prefix: Prefix, view: CacheView, cut: CacheCut, end: int) -> None:
        """Cut what a view shows of a sequence; `end` is the position of the next token."""
        self.model = prefix.model
        self.embed = prefix.embed
        self.chunk_tokens = prefix.chunk_tokens
        config = prefix.model.get_decoder().config
        method = method_of(cut)
        self.cache = BufferedCache(config)
        self._end = end
        shares = []
        counts = []
        n_bytes = 0
        numbers = torch.tensor([*cut.clues], dtype=torch.long, device=view.frames.device)
        clues = torch.isin(view.frames, numbers) & view.is_frame
        n_clues = int(clues.sum())
        nothing = torch.empty(0, dtype=torch.long, device=view.frames.device)
        for layer in range(config.num_hidden_layers if view.cache.layers else 0):
            places = method.keep(view, layer) if view.n_tokens else nothing
            n_counted = int(view.is_frame[places].sum(dim=-1).max()) if len(places) else 0
            if n_counted > view.budget and not method.keeps_all:
                raise ModelError(
                    f"the method {cut.method} keeps {n_counted} tokens of frames where the budget "
                    f"is {view.budget}"
                )
            kept = method.states(view, layer, places)
            pairs = zip(view.opening(layer), kept, strict=True)
            keys, values = (torch.cat(pair, dim=1)[None] for pair in pairs)
            self.cache.update(keys, values, layer)
            n_bytes += method.n_bytes(*kept)
            counts.append(places.shape[-1])
            if n_clues:
                n_found = clues[places].float().sum(dim=-1).mean()
                shares.append(float(n_found) / n_clues)
        self.kept = KeptCache(
            tokens=fmean(counts) if counts else 0,
            bytes=n_bytes,
            clues=fmean(shares) if shares else None,
        )

    @property
    def n_tokens(self) -> int:
        """Tokens that are kept, with those before the first frame."""
        return self.cache.get_seq_length()

    n_pieces = 0

    def tokens_in(self, n_pieces: int) -> int:
        """Return the tokens before what follows, which has no pieces in common with it."""
        assert n_pieces == 0
        return self.n_tokens

    def behind(self, n_pieces: int) -> int:
        """Return the position behind the sequence."""
        assert n_pieces == 0
        return self._end

    @contextmanager
    def extended(self, continuations: Sequence[Sequence[Piece]], reserve: int) -> Iterator[None]:
        """See `Prefix`; nothing is asked behind it afterwards."""
        self.cache.reserve(self.n_tokens + sum(map(n_tokens, continuations)) + reserve)
        yield


@torch.inference_mode()
def attention_of(prefix: Prefix, pieces: Sequence[Piece]) -> list[Tensor]:
    """Return how much pieces behind a frame attend to a sequence before it, by layer: (key heads,
    tokens), the mean of pieces and of heads that share a key head.

    The sequence is as it was afterwards.

    Args:
        prefix: the sequence.
        pieces: the frame, and what is asked behind it.
    """
    config = prefix.model.get_decoder().config
    n_before, n_pieces = prefix.n_tokens, prefix.n_pieces
    prefix.feed(pieces[:1])
    found: list[list[Tensor]] = [[] for _ in range(config.num_hidden_layers)]

    def attend_watched(
        layer: int, query: Tensor, key: Tensor, value: Tensor, scale: float | None
    ) -> Tensor:
        factor = query.shape[-1] ** -0.5 if scale is None else scale
        places = torch.arange(key.shape[-2], device=key.device)
        seen = places <= places[-query.shape[-2] :, None]
        scores = (query @ key.transpose(-1, -2)).float() * factor
        weights = scores.masked_fill(~seen, -torch.inf).softmax(dim=-1)
        found[layer].append(weights[..., :n_before].mean(dim=1))
        return by_mask(seen)(layer, query, key, value, scale)

    device = prefix.cache.layers[0].keys.device
    with attending(config, device, lambda *_: attend_watched, "use another memory"):
        prefix.feed(pieces[1:])
    prefix.cut(n_pieces)
    return [torch.cat(parts, dim=1).mean(dim=1) for parts in found]
