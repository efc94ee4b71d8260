"""Continuations of one encoded prefix, answered together: one row each, decoded in lockstep."""

from collections.abc import Sequence
from typing import Any

import torch
from torch.nn.functional import pad

from model_adapters.hf.decoding import ReplyState, decode_replies
from model_adapters.hf.embedding import Embedder
from model_adapters.hf.prefix import Prefix
from model_adapters.hf.prompt import Piece

__all__ = ["answer_together"]


class _Rows:
    """Continuations of one prefix, of different length, padded on the left so that all end in the same column.

    Padding on the left lets every row append its next token at the same place of the cache. The attention mask hides
    the padding; positions are given explicitly, so they do not depend on it.
    """

    def __init__(self, model: Any, embed: Embedder, prefix: Prefix) -> None:
        self._model = model
        self._embed = embed
        self._prefix = prefix

    @torch.inference_mode()
    def feed(self, continuations: Sequence[Sequence[Piece]], reserve: int) -> torch.Tensor:
        """Encode all continuations; return the logits of each row's next token, (rows, vocabulary)."""
        spans = [self._embed(pieces, self._prefix.end) for pieces in continuations]
        self._ends = [span.end for span in spans]
        width = max(len(span.embeds) for span in spans)
        self._cache = self._prefix.expand(len(spans), width + reserve)
        gaps = [width - len(span.embeds) for span in spans]
        embeds = torch.stack([pad(span.embeds, (0, 0, gap, 0)) for span, gap in zip(spans, gaps, strict=True)])
        positions = torch.cat([pad(span.positions, (gap, 0)) for span, gap in zip(spans, gaps, strict=True)], dim=-2)
        n_prefix = self._prefix.n_tokens
        self._mask = torch.ones(len(spans), n_prefix + width, dtype=torch.long, device=embeds.device)
        for row, gap in enumerate(gaps):
            self._mask[row, n_prefix : n_prefix + gap] = 0
        return self._forward(embeds, positions)

    @torch.inference_mode()
    def step(self, tokens: Sequence[int]) -> torch.Tensor:
        """Feed one token to each row; return the logits of the next, (rows, vocabulary)."""
        spans = [self._embed([token], end) for token, end in zip(tokens, self._ends, strict=True)]
        self._ends = [span.end for span in spans]
        self._mask = pad(self._mask, (0, 1), value=1)
        return self._forward(
            torch.stack([span.embeds for span in spans]), torch.cat([span.positions for span in spans], dim=-2)
        )

    def _forward(self, embeds: torch.Tensor, positions: torch.Tensor) -> torch.Tensor:
        output = self._model(
            inputs_embeds=embeds,
            attention_mask=self._mask,
            position_ids=positions,
            past_key_values=self._cache,
            use_cache=True,
            logits_to_keep=1,
        )
        logits: torch.Tensor = output.logits[:, -1]
        return logits


def answer_together(
    model: Any,
    embed: Embedder,
    *,
    prefix: Prefix,
    prompts: Sequence[Sequence[Piece]],
    n_shared: int,
    replies: Sequence[ReplyState],
) -> None:
    """Decode the replies to prompts that begin with the same `n_shared` pieces, each prompt with more behind them.

    `prefix` has encoded the shared pieces and nothing more; `replies` are empty, one for each prompt.
    """
    rows = _Rows(model, embed, prefix)
    reserve = max(reply.decoding.max_new_tokens for reply in replies)
    logits = rows.feed([prompt[n_shared:] for prompt in prompts], reserve)
    decode_replies(logits, rows.step, replies)
