"""Decoding, token by token, with the checkpoint's own end tokens and repetition penalty.

Draws are transformers' own: temperature, then the most likely tokens (`top_p`), in float32.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import torch
from transformers import (
    GenerationConfig,
    RepetitionPenaltyLogitsProcessor,
    TemperatureLogitsWarper,
    TopPLogitsWarper,
)

from infthor_eval.errors import ModelError
from model_adapters.hf.choices import Choices
from model_adapters.protocols import Decoding

__all__ = ["Generation", "ReplyState", "extend_replies", "read_generation", "write"]

# Settings that change what is decoded and that this decoder does not have, with the values that switch them off.
_UNSUPPORTED: dict[str, tuple[Any, ...]] = {
    "num_beams": (None, 1),
    "no_repeat_ngram_size": (None, 0),
    "min_length": (None, 0),
    "min_new_tokens": (None, 0),
    "bad_words_ids": (None, []),
    "suppress_tokens": (None, []),
    "begin_suppress_tokens": (None, []),
    "forced_bos_token_id": (None,),
    "forced_eos_token_id": (None,),
}


@dataclass(frozen=True)
class Generation:
    """What of a checkpoint's generation settings matters; how much is drawn is the request's own affair.

    Attributes:
        end_ids: tokens that end the turn.
        repetition_penalty: as in the checkpoint (1.05 in Qwen2.5-VL); over context and reply, as transformers does.
    """

    end_ids: frozenset[int]
    repetition_penalty: float = 1.0


def read_generation(config: GenerationConfig) -> Generation:
    """The settings that matter.

    Raises:
        ModelError: the checkpoint asks for something that changes what is decoded and is not supported.
    """
    for name, off in _UNSUPPORTED.items():
        if getattr(config, name, None) not in off:
            raise ModelError(f"the checkpoint's generation config sets {name}, which is not supported; remove it")
    ends = config.eos_token_id
    listed = [] if ends is None else [ends] if isinstance(ends, int) else ends
    if not isinstance(listed, list | tuple) or not all(type(end) is int and end >= 0 for end in listed):
        raise ModelError(f"the checkpoint's eos_token_id is {ends!r:.40}; it is the number of a token, or a list")
    penalty = 1.0 if config.repetition_penalty is None else config.repetition_penalty
    if isinstance(penalty, bool) or not isinstance(penalty, int | float) or not 0 < penalty < math.inf:
        raise ModelError(f"the checkpoint's repetition_penalty is {penalty!r:.40}; it is a number above 0")
    return Generation(frozenset(listed), float(penalty))


class ReplyState:
    """One reply in the making: every token of every reply is chosen here.

    Args:
        generation: the checkpoint's end tokens and penalty.
        decoding: how the reply is decoded.
        context: all ids before the reply; read only where there is a repetition penalty.
        choices: what the reply is held to; None where it is free.
        finished: looks at the ids of a free reply after each token.

    Attributes:
        decoding: how the reply is decoded.
        ids: the reply so far, without the end token.
        done: whether it has ended.
    """

    def __init__(
        self,
        generation: Generation,
        decoding: Decoding,
        *,
        context: Iterable[int],
        choices: Choices | None,
        finished: Callable[[list[int]], bool],
    ) -> None:
        self.decoding = decoding
        self.ids: list[int] = []
        self.done = False
        self._generation = generation
        self._choices = choices
        self._finished = finished
        # How often a token was seen does not matter.
        self._seen = (
            torch.tensor([list(set(context))], dtype=torch.long) if generation.repetition_penalty != 1.0 else None
        )
        self._draws = torch.Generator().manual_seed(decoding.seed)

    @property
    def choice(self) -> str | None:
        """The choice that the reply is; None where it is free."""
        return None if self._choices is None else self._choices.text(self.ids)

    def scores(self, logits: torch.Tensor) -> torch.Tensor:
        """What the next token is chosen by, (vocabulary,), on the logits' device, which nothing is read from."""
        return self._held(self._penalised(logits.float()))

    def take(self, scores: torch.Tensor, likeliest: int, score: float) -> None:
        """Choose the next token, or end the reply.

        Args:
            scores: of all tokens, (vocabulary,), on the CPU where a token is drawn.
            likeliest: the token with the largest.
            score: which that is.

        Raises:
            ModelError: no token has a score.
        """
        if not score > -math.inf:  # the largest is NaN where one is
            raise ModelError(f"no token has a score after {len(self.ids)} tokens of the reply (NaN); try dtype=float32")
        token = likeliest if self.decoding.greedy else self._drawn(scores)
        if token in self._generation.end_ids:
            self.done = True
            return
        self.ids.append(token)
        if self._seen is not None:
            self._seen = torch.cat((self._seen, self._seen.new_full((1, 1), token)), dim=-1)
        self.done = len(self.ids) == self.decoding.max_new_tokens or self._complete()

    def _penalised(self, logits: torch.Tensor) -> torch.Tensor:
        """Logits with those of seen tokens lowered as transformers' repetition penalty does."""
        if self._seen is None:
            return logits
        self._seen = self._seen.to(logits.device)  # copied once, and lengthened there
        penalty = RepetitionPenaltyLogitsProcessor(self._generation.repetition_penalty)
        return penalty(cast(Any, self._seen), cast(Any, logits[None]))[0]

    def _held(self, scores: torch.Tensor) -> torch.Tensor:
        """Scores of what may come next; of a reply that is held to choices, nothing else has any."""
        if self._choices is None:
            return scores
        allowed = self._choices.after(self.ids) | (self._generation.end_ids if self.choice is not None else set())
        held = torch.full_like(scores, -torch.inf)
        at = torch.tensor(sorted(allowed), device=scores.device)
        held[at] = scores[at]
        return held

    def _drawn(self, scores: torch.Tensor) -> int:
        rows = scores[None]
        for warp in (TemperatureLogitsWarper(float(self.decoding.temperature)), TopPLogitsWarper(self.decoding.top_p)):
            rows = warp(cast(Any, None), cast(Any, rows))
        return int(torch.multinomial(rows[0].softmax(dim=-1), 1, generator=self._draws))

    def _complete(self) -> bool:
        return self._finished(self.ids) if self._choices is None else not self._choices.after(self.ids)


def write(logits: torch.Tensor, step: Callable[[Sequence[int]], torch.Tensor], replies: Sequence[ReplyState]) -> None:
    """Write replies token by token, all in step, until each of them is done.

    Args:
        logits: (replies, vocabulary), of each one's first token.
        step: feeds one token to each and returns the logits of the next, (replies, vocabulary).
        replies: what is written.
    """
    while True:
        extend_replies([(reply, logits[row]) for row, reply in enumerate(replies) if not reply.done])
        if all(reply.done for reply in replies):
            return
        # Those that are done are fed something, which nobody reads.
        logits = step([0 if reply.done else reply.ids[-1] for reply in replies])


def extend_replies(replies: Sequence[tuple[ReplyState, torch.Tensor]]) -> None:
    """Choose the next token of replies by their logits, (vocabulary,), or end them.

    Of all of them together the device is read once: that is what a step waits for.

    Raises:
        ModelError: in one of them no token has a score.
    """
    scores = torch.stack([reply.scores(logits) for reply, logits in replies])
    if not all(reply.decoding.greedy for reply, _ in replies):
        scores = scores.cpu()  # where a seed draws the same everywhere
    best = scores.max(dim=-1)
    # As one tensor: a float32 holds the number of any token.
    pairs = torch.stack((best.values, best.indices.float())).T.tolist()
    for (reply, _), row, (score, token) in zip(replies, scores, pairs, strict=True):
        reply.take(row, int(token), score)
