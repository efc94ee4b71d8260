"""Continuations of an encoded prefix or of its beginnings, together: in one sequence behind it,
decoded in lockstep."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import torch

from model_adapters.hf.cached.branch_attention import BranchAttention
from model_adapters.hf.cached.decoding import ReplyState, decode_replies
from model_adapters.hf.cached.kv_cache import cache_arguments
from model_adapters.hf.cached.prefix import Prefix, chunks
from model_adapters.hf.kept.cutting import CutPrefix
from model_adapters.hf.prompting.embedding import Span
from model_adapters.hf.prompting.prompt import Piece, token_ids

_Span = tuple[int, Span]  # of a branch


class _Branches:
    """Continuations of so many pieces of a prefix, each with the positions that it has alone."""

    def __init__(self, prefix: Prefix | CutPrefix, n_shared: Sequence[int]) -> None:
        self._model = model = prefix.model
        self._embed = prefix.embed
        self._prefix = prefix
        self._ends = [prefix.behind(n) for n in n_shared]  # position of the next token of each
        self._lengths = [prefix.tokens_in(n) for n in n_shared]  # tokens of each, with the prefix
        device = model.get_input_embeddings().weight.device
        self._attention = BranchAttention(
            model.get_decoder().config,
            prefix.n_tokens,
            device,
            tuple(self._lengths),
            prefix.sparse,
        )

    @torch.inference_mode()
    def feed(self, continuations: Sequence[Sequence[Piece]]) -> torch.Tensor:
        """Encode all continuations; return each next token's logits, (branches, vocabulary)."""
        logits: dict[int, torch.Tensor] = {}
        for group in self._groups(continuations):
            # The last chunk of a branch has the logits of its next token.
            logits |= self._forward(group)
        return torch.stack([logits[branch] for branch in range(len(continuations))])

    def _groups(self, continuations: Sequence[Sequence[Piece]]) -> Iterator[list[_Span]]:
        """Yield chunks of branches that are encoded in one forward pass."""
        chunk_tokens = self._prefix.chunk_tokens
        group: list[_Span] = []
        n_tokens = 0
        for branch, pieces in enumerate(continuations):
            for chunk in chunks(pieces, chunk_tokens):
                span = self._embed(chunk, self._ends[branch], ())
                self._ends[branch] = span.end
                if group and n_tokens + span.n_tokens > chunk_tokens:
                    yield group
                    group = []
                    n_tokens = 0
                group.append((branch, span))
                n_tokens += span.n_tokens
        yield group

    @torch.inference_mode()
    def step(self, tokens: Mapping[int, int]) -> torch.Tensor:
        """Feed a token to some branches; return the next logits, (these branches, vocabulary)."""
        span = self._embed.words(list(tokens.values()), [self._ends[branch] for branch in tokens])
        for branch in tokens:
            self._ends[branch] += 1
        return self._logits(span.inputs, span.positions, list(tokens), slice(None))

    def _forward(self, group: Sequence[_Span]) -> dict[int, torch.Tensor]:
        """Encode chunks of branches; return the logits behind each branch's last, (vocabulary,)."""
        owners = [branch for branch, span in group for _ in range(span.n_tokens)]
        last = {branch: at for at, branch in enumerate(owners)}
        positions = torch.cat([span.positions for _, span in group], dim=-1)
        inputs = self._embed.join([span for _, span in group])
        rows = self._logits(inputs, positions, owners, list(last.values()))
        return dict(zip(last, rows, strict=True))

    def _logits(
        self,
        inputs: Mapping[str, Any],
        positions: torch.Tensor,
        owners: Sequence[int],
        keep: slice | list[int],  # a tensor would be sent to the first of several devices
    ) -> torch.Tensor:
        """Encode tokens of the owners' branches; return the kept logits, (kept, vocabulary)."""
        n_before = []
        for branch in owners:
            n_before.append(self._lengths[branch])
            self._lengths[branch] += 1
        with self._attention.appended(owners, n_before, positions):
            output = self._model(
                **inputs,
                position_ids=positions,
                **cache_arguments(self._model, self._prefix.cache),
                logits_to_keep=keep,
            )
        logits: torch.Tensor = output.logits[0]
        # A few models return those of all tokens.
        return logits[keep] if len(logits) == len(owners) else logits


def answer_together(
    prefix: Prefix | CutPrefix,
    prompts: Sequence[Sequence[Piece]],
    n_shared: Sequence[int],
    replies: Sequence[ReplyState],
) -> None:
    """Decode the replies to prompts whose first pieces, so many of each, are those of `prefix`.

    `prefix` has encoded the shared pieces and nothing more, and has no more afterwards; `replies`
    are empty, one for each prompt.
    """
    continuations = [prompt[n:] for prompt, n in zip(prompts, n_shared, strict=True)]
    branches = _Branches(prefix, n_shared)
    with prefix.extended(continuations, sum(reply.decoding.max_new_tokens for reply in replies)):
        decode_replies(branches.feed(continuations), branches.step, replies)


def encode_together(prefix: Prefix, continuations: Sequence[Sequence[Piece]]) -> torch.Tensor:
    """Encode continuations of a prefix, of two pieces or more; the last of each is a token of text
    and fed as tokens of replies are.

    Returns:
        Logits of each next token, (continuations, vocabulary).
    """
    branches = _Branches(prefix, [prefix.n_pieces] * len(continuations))
    with prefix.extended(continuations, 0):
        branches.feed([pieces[:-1] for pieces in continuations])
        return branches.step(dict(enumerate(token_ids([pieces[-1] for pieces in continuations]))))
