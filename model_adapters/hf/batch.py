"""Several continuations of one encoded prefix, answered together: one row each, decoded in step."""

from collections.abc import Sequence
from typing import Any

import torch

from model_adapters.hf.decoding import ReplyState, write
from model_adapters.hf.embedding import Embedder
from model_adapters.hf.prefix import Prefix
from model_adapters.hf.prompt import Piece

__all__ = ["answer_together"]


class _Rows:
    """Continuations of one prefix, of different length, padded on the left so that all end at the same column."""

    def __init__(self, model: Any, embed: Embedder, prefix: Prefix) -> None:
        self._model = model
        self._embed = embed
        self._prefix = prefix

    @torch.inference_mode()
    def feed(self, continuations: Sequence[Sequence[Piece]], reserve: int) -> torch.Tensor:
        """Encode all continuations; logits of each row's next token, (rows, vocabulary)."""
        stretches = [self._embed(pieces, self._prefix.end) for pieces in continuations]
        self._ends = [stretch.end for stretch in stretches]
        width = max(len(stretch.embeds) for stretch in stretches)
        self._cache = self._prefix.spread(len(stretches), width + reserve)
        gaps = [width - len(stretch.embeds) for stretch in stretches]
        embeds = torch.stack(
            [
                torch.nn.functional.pad(stretch.embeds, (0, 0, gap, 0))
                for stretch, gap in zip(stretches, gaps, strict=True)
            ]
        )
        positions = torch.cat(
            [
                torch.nn.functional.pad(stretch.positions, (gap, 0))
                for stretch, gap in zip(stretches, gaps, strict=True)
            ],
            dim=-2,
        )
        n_prefix = self._prefix.n_tokens
        self._seen = torch.ones(len(stretches), n_prefix + width, dtype=torch.long, device=embeds.device)
        for row, gap in enumerate(gaps):
            self._seen[row, n_prefix : n_prefix + gap] = 0
        return self._forward(embeds, positions)

    @torch.inference_mode()
    def step(self, tokens: Sequence[int]) -> torch.Tensor:
        """Feed one token to each row; logits of the next, (rows, vocabulary)."""
        stretches = [self._embed([token], end) for token, end in zip(tokens, self._ends, strict=True)]
        self._ends = [stretch.end for stretch in stretches]
        self._seen = torch.nn.functional.pad(self._seen, (0, 1), value=1)
        return self._forward(
            torch.stack([stretch.embeds for stretch in stretches]),
            torch.cat([stretch.positions for stretch in stretches], dim=-2),
        )

    def _forward(self, embeds: torch.Tensor, positions: torch.Tensor) -> torch.Tensor:
        output = self._model(
            inputs_embeds=embeds,
            attention_mask=self._seen,
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
    """Answer prompts that begin with the same pieces.

    Args:
        model: a transformers model.
        embed: embeds stretches of prompts.
        prefix: holds the shared pieces and nothing more.
        prompts: what to answer; each is longer than what is shared.
        n_shared: pieces that all prompts have in common.
        replies: the reply to each, begun.
    """
    rows = _Rows(model, embed, prefix)
    room = max(reply.decoding.max_new_tokens for reply in replies)
    logits = rows.feed([prompt[n_shared:] for prompt in prompts], room)
    write(logits, rows.step, replies)
