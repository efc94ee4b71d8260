"""How a reply begins and what becomes of it, for one checkpoint and whichever way its tokens are computed."""

from collections.abc import Iterable

from model_adapters.hf.choices import read_choices
from model_adapters.hf.decoding import Writing
from model_adapters.hf.loaded import Loaded
from model_adapters.protocols import Decoding, Reply
from model_adapters.stopping import cut_at_stop

__all__ = ["begin_reply", "end_reply"]


def begin_reply(loaded: Loaded, decoding: Decoding, context: Iterable[int]) -> Writing:
    """A reply of no tokens yet.

    Args:
        loaded: the checkpoint.
        decoding: how it is decoded.
        context: all ids before the reply.

    Raises:
        ModelError: the reply may have too few tokens for one of the choices.
    """
    stop_ids = _stop_ids(loaded, decoding)

    def stopped(ids: list[int]) -> bool:
        if not decoding.stop:  # nothing has to be decoded then
            return False
        return ids[-1] in stop_ids or cut_at_stop(_text(loaded, ids), decoding.stop) is not None

    choices = read_choices(loaded.tokenizer, decoding)
    return Writing(loaded.generation, decoding, context=context, choices=choices, finished=stopped)


def end_reply(loaded: Loaded, writing: Writing, n_context: int, n_cached: int) -> Reply:
    """What was written.

    Args:
        loaded: the checkpoint.
        writing: is done.
        n_context: tokens before the reply.
        n_cached: how many of them were not encoded again.
    """
    text = _text(loaded, writing.ids)
    before_stop = cut_at_stop(text, writing.decoding.stop)
    return Reply(
        writing.choice or (text if before_stop is None else before_stop),
        n_reply_tokens=len(writing.ids),
        n_context_tokens=n_context,
        n_cached_tokens=n_cached,
        token_ids=tuple(writing.ids),
    )


def _stop_ids(loaded: Loaded, decoding: Decoding) -> set[int]:
    """Stop strings that are tokens of their own; where they are special ones, a reply's text never shows them."""
    if not decoding.stop:
        return set()
    added: dict[str, int] = loaded.tokenizer.get_added_vocab()
    return {added[string] for string in decoding.stop if string in added}


def _text(loaded: Loaded, ids: list[int]) -> str:
    return str(loaded.tokenizer.decode(ids, skip_special_tokens=True))
