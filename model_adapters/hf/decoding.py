"""Greedy decoding, token by token, with the checkpoint's own end tokens and repetition penalty."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import torch
from transformers import GenerationConfig, RepetitionPenaltyLogitsProcessor

from infthor_eval.errors import ModelError

__all__ = ["Generation", "cut_at_stop", "generate", "penalised", "read_generation"]

# Settings that change greedy decoding and that this decoder does not have, with the values that switch them off.
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
    """What of a checkpoint's generation settings matters to greedy decoding.

    Attributes:
        end_ids: tokens that end the turn.
        repetition_penalty: as in the checkpoint (1.05 in Qwen2.5-VL); over context and reply, as transformers does.
    """

    end_ids: frozenset[int]
    repetition_penalty: float = 1.0


def read_generation(config: GenerationConfig) -> Generation:
    """The settings that matter.

    Raises:
        ModelError: the checkpoint asks for something that changes greedy decoding and is not supported.
    """
    for name, off in _UNSUPPORTED.items():
        if getattr(config, name, None) not in off:
            raise ModelError(f"the checkpoint's generation config sets {name}, which is not supported; remove it")
    ends = config.eos_token_id
    listed = [] if ends is None else [ends] if isinstance(ends, int) else list(ends)
    return Generation(frozenset(listed), config.repetition_penalty or 1.0)


def generate(
    logits: torch.Tensor,
    step: Callable[[int], torch.Tensor],
    *,
    context: Iterable[int],
    settings: Generation,
    max_new_tokens: int,
    finished: Callable[[list[int]], bool],
) -> list[int]:
    """Generate until an end token, the limit, or until `finished` says so.

    Args:
        logits: (vocabulary,), of the first token.
        step: feeds one token and returns the logits of the next.
        context: all ids before the reply; read only where there is a repetition penalty.
        settings: end tokens and penalty.
        max_new_tokens: limit.
        finished: looks at the ids so far after each token.

    Returns:
        The ids without the end token.
    """
    seen = set(context) if settings.repetition_penalty != 1.0 else set()  # how often does not matter
    reply: list[int] = []
    while True:
        token = int(penalised(logits.float(), seen, settings.repetition_penalty).argmax())
        if token in settings.end_ids:
            return reply
        reply.append(token)
        seen.add(token)
        if len(reply) == max_new_tokens or finished(reply):
            return reply
        logits = step(token)


def penalised(logits: torch.Tensor, seen: set[int], penalty: float) -> torch.Tensor:
    """Logits, (vocabulary,), with those of seen tokens lowered as transformers' repetition penalty does."""
    if penalty == 1.0:
        return logits
    ids = torch.tensor([list(seen)], device=logits.device)
    return RepetitionPenaltyLogitsProcessor(penalty)(cast(Any, ids), cast(Any, logits[None]))[0]


def cut_at_stop(text: str, stop: Sequence[str]) -> str | None:
    """The text before the first stop string in it, or None where there is none."""
    found = [text.index(string) for string in stop if string in text]
    return text[: min(found)] if found else None
