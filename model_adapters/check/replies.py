"""Checks of replies that hold for every model.

Each check raises `ContractError`, which names the clause that does not hold.
"""

from infthor_eval.formats.frames import FrameRef
from model_adapters.check.clauses import (
    GREEDY,
    NEW_TOKENS,
    QUESTION,
    ask,
    require,
    same_reply,
    start_conversation,
)
from model_adapters.protocols import Conversation, Decoding, Model, Part, Reply


def check_reply(model: Model, frame: FrameRef) -> None:
    """Check one reply: its counts and ids, its length, its stop strings."""
    talk = start_conversation(model, frame, QUESTION)
    size = talk.n_tokens
    first = talk.reply(GREEDY)
    require(isinstance(first, Reply), "reply() does not return a Reply")
    if model.capabilities.counts_tokens:
        _check_counted(first, size)
    _check_ids(model, first)
    require(talk.n_tokens == size, "reply() changes the conversation")
    if model.capabilities.deterministic:
        require(
            same_reply(first, talk.reply(GREEDY)),
            "the same question is not answered the same way twice",
        )
        _check_short(talk, first)
    _check_stop(model, talk, first)


def check_frames(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that the model sees the frames."""
    # Equal replies to one question may be chance, so one of several replies has to differ.
    questions = [
        QUESTION,
        "\nIs it bright or dark?",
        "\nWhat colour is it?",
        "\nDescribe the picture.",
    ]
    differ = any(
        not same_reply(ask(model, black, text), ask(model, white, text)) for text in questions
    )
    require(
        differ, "a black and a white frame get the same replies: the model does not see the frames"
    )


def check_sharing(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that a reply does not depend on what was asked before."""
    talk = start_conversation(model, black, white)
    start = talk.mark()
    shared = []
    for text in (QUESTION, "\nWhat colour was the first frame?"):
        talk.append(text)
        shared.append(talk.reply(GREEDY))
        talk.rewind(start)
    ask(model, white, "\nSomething else.")  # evicts whatever the back end has cached
    fresh = ask(model, black, white, "\nWhat colour was the first frame?")
    alike = same_reply(shared[1], fresh) or not model.capabilities.deterministic
    require(alike, "a reply after a rewind differs from that of a new conversation")


def check_continuations(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that several continuations get the replies that each of them gets alone."""
    talk = start_conversation(model, black)
    continuations: list[list[Part]] = [
        [QUESTION],
        [white, "\nWhat colours are the frames?"],
        ["\nWhy?"],
    ]
    size = talk.n_tokens
    together = talk.replies(continuations, GREEDY)
    require(talk.n_tokens == size, "replies() changes the conversation")
    require(
        len(together) == len(continuations), "replies() does not give one reply per continuation"
    )
    alone = [ask(model, black, *parts) for parts in continuations]
    alike = all(map(same_reply, together, alone)) or not model.capabilities.deterministic
    require(alike, "replies() differs from asking one by one")
    require(talk.replies([], GREEDY) == [], "replies() to no continuations is not an empty list")


def _check_counted(reply: Reply, size: int | None) -> None:
    require(
        reply.n_context_tokens == size,
        "n_tokens before a reply is not the reply's n_context_tokens",
    )
    cached = reply.n_cached_tokens
    n_new = reply.n_reply_tokens
    require(
        cached is not None and 0 <= cached < (size or 0),
        "n_cached_tokens is not between 0 and the context",
    )
    require(
        n_new is not None and 0 <= n_new <= NEW_TOKENS,
        "n_reply_tokens is not between 0 and max_new_tokens",
    )


def _check_ids(model: Model, reply: Reply) -> None:
    if not model.capabilities.token_ids:
        require(reply.token_ids is None, "a reply has token_ids though token_ids is false")
        return
    require(reply.token_ids is not None, "a reply has no token_ids")
    n_ids = len(reply.token_ids or ())
    require(n_ids <= NEW_TOKENS, "a reply has more tokens than max_new_tokens")
    require(reply.n_reply_tokens == n_ids, "n_reply_tokens is not the number of token_ids")


def _check_short(talk: Conversation, whole: Reply) -> None:
    if whole.token_ids is not None:
        short = talk.reply(Decoding(max_new_tokens=1))
        require(
            short.token_ids == whole.token_ids[:1],
            "a shorter reply is not the start of a longer one",
        )


def _check_stop(model: Model, talk: Conversation, whole: Reply) -> None:
    if len(whole.text) < 2:
        return
    stop = whole.text[len(whole.text) // 2 :]
    cut = talk.reply(Decoding(max_new_tokens=NEW_TOKENS, stop=(stop,))).text
    expected = whole.text[: whole.text.index(stop)] if model.capabilities.deterministic else cut
    require(
        stop not in cut and cut == expected, "a stop string and what follows it are not cut off"
    )
