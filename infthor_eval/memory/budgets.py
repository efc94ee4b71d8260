"""Budgets of tokens, and what may be recalled within them."""

from collections.abc import Sequence

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.memory.protocol import Observation, Recalled, tokens_of

__all__ = ["check_recalled", "read_budget"]

_MOST_TOKENS = 10**9  # more is a typing error


def read_budget(text: str | None) -> int | None:
    """Return a budget in tokens; "4k" is 4,000.

    Raises:
        UsageError: it is none.
    """
    if text is None:
        return None
    number, thousands = (text[:-1], 1000) if text.lower().endswith("k") else (text, 1)
    if not number.isdecimal() or not 0 < int(number) < _MOST_TOKENS:
        raise UsageError(f"--budget {text}: give a number of tokens from 1, such as 500 or 4k")
    return int(number) * thousands


def check_recalled(
    recalled: Recalled,
    past: Sequence[Observation],
    name: str,
    budget: int | None,
    tokens_per_frame: int | None,
) -> None:
    """Check what a memory recalled: texts, and steps that it observed, within its budget.

    Raises:
        ModelError: it may not; the message names the memory.
    """
    for piece in recalled:
        if isinstance(piece, str):
            if not piece.strip():
                raise ModelError(f"the memory {name} recalls an empty text; leave it out")
        elif not isinstance(piece, Observation) or not 0 <= piece.number < len(past):
            wrong = "which is neither a text nor a step that it has observed"
            raise ModelError(f"the memory {name} recalls {piece!r:.60}, {wrong}")
    if budget is not None and tokens_per_frame is not None:
        n_tokens = tokens_of(recalled, tokens_per_frame)
        if n_tokens > budget:
            raise ModelError(
                f"the memory {name} recalls {n_tokens} tokens where the budget is {budget}"
            )
