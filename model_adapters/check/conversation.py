"""Checks of conversations: parts, turns, marks and token counts.

Each check raises `ContractError`, which names the clause that does not hold.
"""

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.check.clauses import (
    GREEDY,
    QUESTION,
    raises,
    require,
    same_reply,
    start_conversation,
)
from model_adapters.protocols import Conversation, Model


def check_parts(model: Model, frame: FrameRef) -> None:
    """Check that texts and frames can be appended, and nothing else."""
    split = start_conversation(model, frame, "\nWhat do", " you see?")
    whole = start_conversation(model, frame, "\nWhat do you see?")
    require(
        _alike(model, split, whole),
        "a text appended in two pieces differs from the same text in one",
    )
    require(
        raises(TypeError, split.append, 3),
        "append() of neither text nor frame does not raise TypeError",
    )
    require(
        raises(ValueError, split.append, "x", role="narrator"),
        "append() in an unknown role does not raise",
    )
    require(_alike(model, split, whole), "a refused append() changes the conversation")


def check_counts(model: Model, frame: FrameRef) -> None:
    """Check that token counts are exact if the model claims so, and None if it does not."""
    if not model.capabilities.counts_tokens:
        n_tokens = start_conversation(model, frame, QUESTION).n_tokens
        require(n_tokens is None, "n_tokens is not None though counts_tokens is false")
        require(
            model.tokens_per_frame(frame) is None,
            "tokens_per_frame() is not None though counts_tokens is false",
        )
        return
    talk = model.conversation()
    sizes = []
    for parts in ((frame,), (frame,), ("\nThe first frame.",), (frame, frame), (QUESTION,)):
        talk.append(*parts)
        sizes.append(talk.n_tokens or 0)
    require(sizes == sorted(set(sizes)), f"n_tokens does not grow with every part: {sizes}")
    per_frame = model.tokens_per_frame(frame) or 0
    require(
        0 < per_frame <= sizes[1] - sizes[0],
        "tokens_per_frame() is not within what a frame adds to n_tokens",
    )


def check_turns(model: Model, frame: FrameRef) -> None:
    """Check that turns are kept apart, and that the model replies to a user turn only."""
    _check_nothing_to_reply_to(model.conversation(), "an empty conversation")
    talk = start_conversation(model, frame, QUESTION)
    one_turn = talk.n_tokens
    talk.append("A table.", role="assistant")
    _check_nothing_to_reply_to(talk, "a conversation whose last turn is the assistant's")
    talk.append("\nAre you sure?")
    talk.reply(GREEDY)
    require(
        one_turn is None or one_turn < (talk.n_tokens or 0),
        "n_tokens of three turns is not above that of one",
    )
    _check_system(model, frame)


def check_marks(model: Model, frame: FrameRef) -> None:
    """Check marks and rewinding."""
    talk = start_conversation(model, frame, QUESTION)
    unchanged = start_conversation(model, frame, QUESTION)
    early = talk.mark()
    talk.append(" More.")
    late = talk.mark()
    talk.rewind(early)
    require(_alike(model, talk, unchanged), "rewind() does not bring back n_tokens or the reply")
    talk.append("Yes.", role="assistant")
    talk.append(" More and more.")
    require(
        raises(ValueError, talk.rewind, late),
        "rewind() to a mark behind the point rewound to does not raise",
    )
    talk.rewind(early)
    require(_alike(model, talk, unchanged), "a second rewind() to the same mark fails")
    foreign = start_conversation(model, frame).mark()
    require(
        raises(ValueError, talk.rewind, foreign),
        "rewind() to another conversation's mark does not raise",
    )


def _check_nothing_to_reply_to(talk: Conversation, what: str) -> None:
    refuses = raises(ModelError, talk.reply, GREEDY)
    require(refuses, f"reply() to {what} does not raise ModelError; call check_turns first")


def _check_system(model: Model, frame: FrameRef) -> None:
    talk = model.conversation()
    talk.append("Be brief.", role="system")
    _check_nothing_to_reply_to(talk, "a conversation whose last turn is the system's")
    talk.append(frame, QUESTION)
    try:
        talk.reply(GREEDY)
    except ModelError:
        return  # the model does not support system turns


def _alike(model: Model, one: Conversation, other: Conversation) -> bool:
    """Return whether two conversations look the same: by tokens, or else a deterministic reply."""
    if model.capabilities.counts_tokens:
        return one.n_tokens == other.n_tokens
    return not model.capabilities.deterministic or same_reply(
        one.reply(GREEDY), other.reply(GREEDY)
    )
