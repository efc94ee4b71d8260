"""Several endings of one encoded prefix, answered together: one row each, decoded in step."""

from collections.abc import Callable, Sequence
from typing import Any

import torch

from model_adapters.engine.decoding import Generation, penalised
from model_adapters.engine.embedding import Embedder
from model_adapters.engine.prefix import Prefix
from model_adapters.engine.prompt import Unit, token_ids

__all__ = ["answer_together"]


class _Rows:
    """Endings of different length behind the same prefix, padded on the left so that all end at the same column."""

    def __init__(self, model: Any, embed: Embedder, prefix: Prefix) -> None:
        self._model = model
        self._embed = embed
        self._prefix = prefix

    @torch.inference_mode()
    def feed(self, endings: Sequence[Sequence[Unit]], reserve: int) -> torch.Tensor:
        """Encode all endings; logits of each row's next token, (rows, vocabulary)."""
        pieces = [self._embed(units, self._prefix.end) for units in endings]
        self._ends = [piece.end for piece in pieces]
        width = max(len(piece.embeds) for piece in pieces)
        self._cache = self._prefix.spread(len(pieces), width + reserve)
        gaps = [width - len(piece.embeds) for piece in pieces]
        embeds = torch.stack(
            [torch.nn.functional.pad(piece.embeds, (0, 0, gap, 0)) for piece, gap in zip(pieces, gaps, strict=True)]
        )
        positions = torch.cat(
            [torch.nn.functional.pad(piece.positions, (gap, 0)) for piece, gap in zip(pieces, gaps, strict=True)],
            dim=-2,
        )
        n_prefix = self._prefix.n_tokens
        self._seen = torch.ones(len(pieces), n_prefix + width, dtype=torch.long, device=embeds.device)
        for row, gap in enumerate(gaps):
            self._seen[row, n_prefix : n_prefix + gap] = 0
        return self._forward(embeds, positions)

    @torch.inference_mode()
    def step(self, tokens: Sequence[int]) -> torch.Tensor:
        """Feed one token to each row; logits of the next, (rows, vocabulary)."""
        pieces = [self._embed([token], end) for token, end in zip(tokens, self._ends, strict=True)]
        self._ends = [piece.end for piece in pieces]
        self._seen = torch.nn.functional.pad(self._seen, (0, 1), value=1)
        return self._forward(
            torch.stack([piece.embeds for piece in pieces]), torch.cat([piece.positions for piece in pieces], dim=-2)
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
    prompts: Sequence[Sequence[Unit]],
    n_shared: int,
    settings: Generation,
    max_new_tokens: int,
    finished: Callable[[list[int]], bool],
) -> list[list[int]]:
    """Answer prompts that begin with the same units.

    Args:
        model: a transformers model.
        embed: embeds pieces of prompts.
        prefix: holds the shared units and nothing more.
        prompts: what to answer; each is longer than what is shared.
        n_shared: units that all prompts have in common.
        settings: end tokens and penalty.
        max_new_tokens: limit for each.
        finished: looks at a reply's ids so far after each token.

    Returns:
        The ids of each reply without the end token.
    """
    rows = _Rows(model, embed, prefix)
    logits = rows.feed([prompt[n_shared:] for prompt in prompts], max_new_tokens)
    penalty = settings.repetition_penalty
    seen = [set(token_ids(prompt)) if penalty != 1.0 else set() for prompt in prompts]
    replies: list[list[int]] = [[] for _ in prompts]
    going = set(range(len(prompts)))
    while True:
        tokens = [0] * len(prompts)  # rows that are done are fed something, which nobody reads
        for row in sorted(going):
            token = int(penalised(logits[row].float(), seen[row], penalty).argmax())
            if token in settings.end_ids:
                going.discard(row)
                continue
            tokens[row] = token
            replies[row].append(token)
            seen[row].add(token)
            if len(replies[row]) == max_new_tokens or finished(replies[row]):
                going.discard(row)
        if not going:
            return replies
        logits = rows.step(tokens)
