"""How a reply begins and what becomes of it, for one checkpoint and whichever way its tokens are computed."""

from collections.abc import Iterable, Sequence
from typing import Any

from model_adapters.hf.choices import read_choices
from model_adapters.hf.decoding import ReplyState
from model_adapters.hf.loaded import Loaded
from model_adapters.protocols import Decoding, Reply
from model_adapters.stopping import cut_at_stop

__all__ = ["begin_reply", "end_reply", "said", "stop_ids"]


def begin_reply(loaded: Loaded, decoding: Decoding, context: Iterable[int]) -> ReplyState:
    """A reply of no tokens yet.

    Args:
        loaded: the checkpoint.
        decoding: how it is decoded.
        context: all ids before the reply.

    Raises:
        ModelError: the reply may have too few tokens for one of the choices.
    """
    ends = stop_ids(loaded.tokenizer, decoding)

    def stopped(ids: list[int]) -> bool:
        if not decoding.stop:  # nothing has to be decoded then
            return False
        return ids[-1] in ends or cut_at_stop(_text(loaded.tokenizer, ids), decoding.stop) is not None

    choices = read_choices(loaded.tokenizer, decoding)
    return ReplyState(loaded.generation, decoding, context=context, choices=choices, finished=stopped)


def end_reply(loaded: Loaded, writing: ReplyState, n_context: int, n_cached: int) -> Reply:
    """What was written.

    Args:
        loaded: the checkpoint.
        writing: is done.
        n_context: tokens before the reply.
        n_cached: how many of them were not encoded again.
    """
    return Reply(
        writing.choice or said(loaded.tokenizer, writing.ids, writing.decoding),
        n_reply_tokens=len(writing.ids),
        n_context_tokens=n_context,
        n_cached_tokens=n_cached,
        token_ids=tuple(writing.ids),
    )


def said(tokenizer: Any, ids: Sequence[int], decoding: Decoding) -> str:
    """The text of a free reply, before its first stop string.

    Args:
        tokenizer: the checkpoint's.
        ids: of the reply, without the end token.
        decoding: has the stop strings.
    """
    text = _text(tokenizer, ids)
    before_stop = cut_at_stop(text, decoding.stop)
    return text if before_stop is None else before_stop


def stop_ids(tokenizer: Any, decoding: Decoding) -> set[int]:
    """Stop strings that are tokens of their own; where they are special ones, a reply's text never shows them."""
    if not decoding.stop:
        return set()
    added: dict[str, int] = tokenizer.get_added_vocab()
    return {added[string] for string in decoding.stop if string in added}


def _text(tokenizer: Any, ids: Sequence[int]) -> str:
    return str(tokenizer.decode(list(ids), skip_special_tokens=True))
