"""Start and end of a reply, however its tokens are computed."""

from collections.abc import Iterable, Sequence
from typing import Any

from model_adapters.hf.cached.decoding import ReplyState, read_choices
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.hashing import hash_context
from model_adapters.protocols import Decoding, KeptCache, Reply
from model_adapters.thinking import cut_at_stop


def begin_reply(
    loaded: LoadedCheckpoint,
    decoding: Decoding,
    context: Iterable[int],
    *,
    keep_margins: bool = False,
) -> ReplyState:
    """Return an empty reply; the context has all ids before it."""
    ends = stop_ids(loaded.tokenizer, decoding)

    def has_stopped(ids: list[int]) -> bool:
        if not decoding.stop:  # saves decoding the text after every token
            return False
        return ids[-1] in ends or cut_at_stop(_text(loaded, ids), decoding.stop) is not None

    choices = read_choices(loaded.tokenizer, decoding)
    return ReplyState(
        loaded.generation,
        decoding,
        context=context,
        choices=choices,
        finished=has_stopped,
        keep_margins=keep_margins,
    )


def end_reply(
    loaded: LoadedCheckpoint,
    state: ReplyState,
    context: Sequence[int],
    frames_hash: str | None,
    n_cached: int,
    kept: KeptCache | None = None,
) -> Reply:
    """Return a finished reply.

    Args:
        loaded: the model.
        state: the reply.
        context: the ids of all tokens before it.
        frames_hash: hash of the pixels of its frames, if they are known.
        n_cached: tokens of the context that were not encoded again.
        kept: what was kept of the cache, if it was cut.
    """
    return Reply(
        state.choice or reply_text(loaded, state.ids, state.decoding),
        n_reply_tokens=len(state.ids),
        n_context_tokens=len(context),
        n_cached_tokens=n_cached,
        token_ids=tuple(state.ids),
        context_hash=hash_context(context),
        frames_hash=frames_hash,
        margins=None if state.margins is None else tuple(state.margins),
        kept=kept,
    )


def reply_text(loaded: LoadedCheckpoint, ids: Sequence[int], decoding: Decoding) -> str:
    """Return the text of a free reply before its first stop string; the ids have no end token.

    A marker of thoughts that the template wrote before the reply is there, too, as if the model had
    written it.
    """
    text = _text(loaded, ids)
    before_stop = cut_at_stop(text, decoding.stop)
    return loaded.opening + (text if before_stop is None else before_stop)


def stop_ids(tokenizer: Any, decoding: Decoding) -> set[int]:
    """Return the ids of stop strings that are single tokens; special tokens never appear in the
    text of a reply."""
    if not decoding.stop:
        return set()
    added: dict[str, int] = tokenizer.get_added_vocab()
    return {added[string] for string in decoding.stop if string in added}


def _text(loaded: LoadedCheckpoint, ids: Sequence[int]) -> str:
    """Return a reply's text without special tokens, but for those around what the model thinks."""
    pieces: list[str] = []
    start = 0
    for at, token in enumerate(ids):
        if token in loaded.marker_ids:
            pieces += _decoded(loaded, ids[start:at]), loaded.marker_ids[token]
            start = at + 1
    return "".join((*pieces, _decoded(loaded, ids[start:])))


def _decoded(loaded: LoadedCheckpoint, ids: Sequence[int]) -> str:
    return str(loaded.tokenizer.decode(list(ids), skip_special_tokens=True))
