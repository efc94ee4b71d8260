"""Replies that are restricted to given texts."""

from collections.abc import Sequence
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.protocols import Decoding


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
