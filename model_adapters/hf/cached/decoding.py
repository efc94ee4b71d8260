"""Decoding, token by token, with the checkpoint's end tokens and repetition penalty.

Sampling is that of transformers: temperature, then the most likely tokens (`top_p`), in float32.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
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
from model_adapters.protocols import Decoding

# Settings that change the reply and that this decoder does not support, with the values that switch
# them off.
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


# Of margins, in nats: where one token alone is allowed there is no second.
_LARGEST_MARGIN = 1000.0


@dataclass(frozen=True)
class Generation:
    """The generation settings of a checkpoint that are used; requests have those of sampling.

    Attributes:
        end_ids: tokens that end the turn.
        repetition_penalty: penalty of tokens in context and reply, as in transformers (1.05 in
            Qwen2.5-VL).
    """

    end_ids: frozenset[int]
    repetition_penalty: float = 1.0


def read_generation(config: GenerationConfig) -> Generation:
    """Return the settings that are used."""
    for name, off in _UNSUPPORTED.items():
        if getattr(config, name, None) not in off:
            raise ModelError(
                f"the checkpoint's generation config sets {name}, which is not supported; remove it"
            )
    ends = config.eos_token_id
    listed = [] if ends is None else [ends] if isinstance(ends, int) else ends
    if not isinstance(listed, list | tuple) or not all(
        type(end) is int and end >= 0 for end in listed
    ):
        raise ModelError(
            f"the checkpoint's eos_token_id is {ends!r:.40}; use the id of a token, or a list of "
            "ids"
        )
    penalty = 1.0 if config.repetition_penalty is None else config.repetition_penalty
    if (
        isinstance(penalty, bool)
        or not isinstance(penalty, int | float)
        or not 0 < penalty < math.inf
    ):
        raise ModelError(
            f"the checkpoint's repetition_penalty is {penalty!r:.40}; use a number above 0"
        )
    return Generation(frozenset(listed), float(penalty))


class Choices:
    """The allowed replies, token by token.

    Args:
        ids: token ids of each allowed reply, with its text.
    """

    def __init__(self, ids: dict[tuple[int, ...], str]) -> None:
        self._texts = ids

    def after(self, ids: Sequence[int]) -> set[int]:
        """Return the tokens that continue these ids towards an allowed reply; none if the reply has
        to end."""
        prefix = tuple(ids)
        n = len(ids)
        return {choice[n] for choice in self._texts if len(choice) > n and choice[:n] == prefix}

    def text(self, ids: Sequence[int]) -> str | None:
        """Return the allowed reply with these ids, or None."""
        return self._texts.get(tuple(ids))


def read_choices(tokenizer: Any, decoding: Decoding) -> Choices | None:
    """Return the allowed replies as token ids, or None if the reply is free.

    Each text has one spelling, the tokenizer's own: other sequences of tokens with the same text
    are not allowed.
    """
    ids: dict[tuple[int, ...], str] = {}
    for text in decoding.choices:
        spelling = tuple(tokenizer(text, add_special_tokens=False)["input_ids"])
        if len(spelling) > decoding.max_new_tokens:
            raise ModelError(
                f"the choice {text[:40]!r} has {len(spelling)} tokens and a reply may have "
                f"{decoding.max_new_tokens}; raise max_new_tokens"
            )
        ids.setdefault(spelling, text)
    return Choices(ids) if ids else None


class ReplyState:
    """A reply that is being decoded; every token of every reply is chosen here.

    Args:
        generation: end tokens and penalty of the checkpoint.
        decoding: decoding of the reply.
        context: all ids before the reply; read only if there is a repetition penalty.
        choices: allowed replies, or None for a free reply.
        finished: called with the ids of a free reply after each token; returns whether it ends
            here.
        keep_margins: whether to keep how near a tie each choice was.

    Attributes:
        decoding: decoding of the reply.
        ids: ids of the reply so far, without the end token.
        done: true once the reply has ended.
        margins: difference of the two largest scores at each choice of a token; None unless they
            are kept.
    """

    def __init__(
        self,
        generation: Generation,
        decoding: Decoding,
        *,
        context: Iterable[int],
        choices: Choices | None,
        finished: Callable[[list[int]], bool],
        keep_margins: bool = False,
    ) -> None:
        self.decoding = decoding
        self.ids: list[int] = []
        self.done = False
        self.margins: list[float] | None = [] if keep_margins else None
        self._generation = generation
        self._choices = choices
        self._finished = finished
        penalty = decoding.repetition_penalty
        self._penalty = generation.repetition_penalty if penalty is None else penalty
        # The penalty depends on the set of tokens, not on their counts.
        self._penalised_ids = (
            torch.tensor([list(set(context))], dtype=torch.long) if self._penalty != 1.0 else None
        )
        self._generator = torch.Generator().manual_seed(decoding.seed)

    @property
    def choice(self) -> str | None:
        """The choice that the reply spells, or None."""
        return None if self._choices is None else self._choices.text(self.ids)

    def scores(self, logits: torch.Tensor) -> torch.Tensor:
        """Return the scores of all next tokens, (vocabulary,), on the logits' device, without
        waiting for it."""
        return self._restrict(self._penalise(logits.float()))

    def take(self, scores: torch.Tensor, likeliest: int, score: float, second: float) -> None:
        """Choose the next token, or end the reply.

        Args:
            scores: scores of all tokens, (vocabulary,), on the CPU if a token is sampled.
            likeliest: token with the largest score.
            score: the largest score.
            second: the second largest; read only if margins are kept.
        """
        if not score > -math.inf:  # the maximum is NaN if any score is
            raise ModelError(
                f"no token has a score after {len(self.ids)} tokens of the reply (NaN); try "
                "dtype=float32"
            )
        if self.margins is not None:
            self.margins.append(min(score - second, _LARGEST_MARGIN))
        token = likeliest if self.decoding.greedy else self._sample(scores)
        if token in self._generation.end_ids:
            self.done = True
            return
        self.ids.append(token)
        if self._penalised_ids is not None:
            new = self._penalised_ids.new_full((1, 1), token)
            self._penalised_ids = torch.cat((self._penalised_ids, new), dim=-1)
        self.done = len(self.ids) == self.decoding.max_new_tokens or self._ends_here()

    def _penalise(self, logits: torch.Tensor) -> torch.Tensor:
        """Return logits with earlier tokens' lowered by transformers' repetition penalty."""
        if self._penalised_ids is None:
            return logits
        # Copied once, then extended on the device.
        self._penalised_ids = self._penalised_ids.to(logits.device)
        penalty = RepetitionPenaltyLogitsProcessor(self._penalty)
        return penalty(cast(Any, self._penalised_ids), cast(Any, logits[None]))[0]

    def _restrict(self, scores: torch.Tensor) -> torch.Tensor:
        """Return scores in which only tokens that lead to a choice are finite; a free reply's are
        unchanged."""
        if self._choices is None:
            return scores
        # A choice may be the beginning of another: where one is complete, the reply may end or go
        # on.
        allowed = self._choices.after(self.ids) | (
            self._generation.end_ids if self.choice is not None else set()
        )
        restricted = torch.full_like(scores, -torch.inf)
        at = torch.tensor(sorted(allowed), device=scores.device)
        restricted[at] = scores[at]
        return restricted

    def _sample(self, scores: torch.Tensor) -> int:
        rows = scores[None]
        for warp in (
            TemperatureLogitsWarper(float(self.decoding.temperature)),
            TopPLogitsWarper(self.decoding.top_p),
        ):
            rows = warp(cast(Any, None), cast(Any, rows))
        return int(torch.multinomial(rows[0].softmax(dim=-1), 1, generator=self._generator))

    def _ends_here(self) -> bool:
        return (
            self._finished(self.ids) if self._choices is None else not self._choices.after(self.ids)
        )


def decode_replies(
    logits: torch.Tensor,
    step: Callable[[Mapping[int, int]], torch.Tensor],
    replies: Sequence[ReplyState],
) -> None:
    """Decode replies in lockstep until all are done.

    Args:
        logits: logits of the first token of each reply, (replies, vocabulary).
        step: feeds tokens, by the numbers of the replies that are not done, and returns the logits
            of the next ones, (these replies, vocabulary).
        replies: empty replies, which are filled in place.
    """
    numbers = list(range(len(replies)))
    while numbers:
        extend_replies(
            [(replies[number], row) for number, row in zip(numbers, logits, strict=True)]
        )
        numbers = [number for number in numbers if not replies[number].done]
        if numbers:
            logits = step({number: replies[number].ids[-1] for number in numbers})


def extend_replies(replies: Sequence[tuple[ReplyState, torch.Tensor]]) -> None:
    """Choose the next token of each reply by its logits, (vocabulary,), or end the reply.

    The device is read once for all replies, because each read waits for the whole step.
    """
    scores = torch.stack([reply.scores(logits) for reply, logits in replies])
    if not all(reply.decoding.greedy for reply, _ in replies):
        scores = scores.cpu()  # where a seed gives the same samples on every machine
    best = scores.max(dim=-1)
    seconds = best.values
    if any(reply.margins is not None for reply, _ in replies):
        seconds = scores.topk(2, dim=-1).values[:, 1]
    # One tensor, so one read: float32 represents every token id exactly.
    read = torch.stack((best.values, best.indices.float(), seconds)).T.tolist()
    for (reply, _), row, (score, token, second) in zip(replies, scores, read, strict=True):
        reply.take(row, int(token), score, second)
