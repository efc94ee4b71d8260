"""Budgets of tokens, and what may be recalled within them."""

from collections.abc import Sequence
from itertools import islice
from typing import Any

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.memory.protocol import Observation, Recalled, tokens_of

_MOST_TOKENS = 10**9  # more is a typing error
_MOST_PIECES = 100_000  # more than any trajectory has steps


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


def pieces_of(given: Any, name: str) -> list[Any]:
    """Return what a memory gave as a list; whoever calls wraps the errors of a memory's code.

    Raises:
        ModelError: it is a text, or does not end; the message names the memory.
    """
    if isinstance(given, str | bytes):
        raise ModelError(
            f"the memory {name} recalls a {type(given).__name__}; give a list of texts and steps"
        )
    pieces = list(islice(given, _MOST_PIECES + 1))
    if len(pieces) > _MOST_PIECES:
        raise ModelError(f"the memory {name} recalls more than {_MOST_PIECES:,} pieces; give less")
    return pieces


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
            _require_unicode(piece, name)
        elif not _is_step(piece, len(past)):
            wrong = "which is neither a text nor a step that it has observed"
            raise ModelError(f"the memory {name} recalls {piece!r:.60}, {wrong}")
    if budget is not None and tokens_per_frame is not None:
        n_tokens = tokens_of(recalled, tokens_per_frame)
        if n_tokens > budget:
            raise ModelError(
                f"the memory {name} recalls {n_tokens} tokens where the budget is {budget}"
            )


def _require_unicode(text: str, name: str) -> None:
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ModelError(f"the memory {name} recalls {text!r:.60}, no valid Unicode") from error


def _is_step(piece: Any, n_steps: int) -> bool:
    if not isinstance(piece, Observation):
        return False
    return type(piece.number) is int and 0 <= piece.number < n_steps
