"""Replies that are held to some texts."""

from collections.abc import Sequence
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.protocols import Decoding

__all__ = ["Choices", "read_choices"]


class Choices:
    """The texts that a reply may be, token by token.

    Args:
        ids: the texts by the ids that spell them.
    """

    def __init__(self, ids: dict[tuple[int, ...], str]) -> None:
        self._texts = ids

    def after(self, ids: Sequence[int]) -> set[int]:
        """The tokens that lead on from here towards some text; none where a reply has to end."""
        begun, n = tuple(ids), len(ids)
        return {choice[n] for choice in self._texts if len(choice) > n and choice[:n] == begun}

    def text(self, ids: Sequence[int]) -> str | None:
        """The text that is spelled by these ids, None where there is none."""
        return self._texts.get(tuple(ids))


def read_choices(tokenizer: Any, decoding: Decoding) -> Choices | None:
    """What a reply is held to; None where it is free.

    Args:
        tokenizer: the checkpoint's.
        decoding: has the texts.

    Raises:
        ModelError: a text takes more tokens than the reply may have.
    """
    ids: dict[tuple[int, ...], str] = {}
    for text in decoding.choices:
        spelled = tuple(tokenizer(text, add_special_tokens=False)["input_ids"])
        if len(spelled) > decoding.max_new_tokens:
            raise ModelError(
                f"the choice {text[:40]!r} takes {len(spelled)} tokens and a reply may have {decoding.max_new_tokens}; "
                "raise max_new_tokens"
            )
        ids.setdefault(spelled, text)
    return Choices(ids) if ids else None
