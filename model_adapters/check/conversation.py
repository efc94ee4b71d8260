"""How a conversation has to be kept: parts, turns, marks, and counts where the model counts."""

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.check.asking import GREEDY, QUESTION, opened, same
from model_adapters.check.clauses import raises, require
from model_adapters.protocols import Conversation, Model

__all__ = ["check_counts", "check_marks", "check_parts", "check_turns"]


def check_parts(model: Model, frame: FrameRef) -> None:
    """Check what can be appended.

    Raises:
        ContractError: names the clause that does not hold.
    """
    split, whole = opened(model, frame, "\nWhat do", " you see?"), opened(model, frame, "\nWhat do you see?")
    require(_alike(model, split, whole), "a text appended in two pieces differs from the same text in one")
    require(raises(TypeError, split.append, 3), "append() of something that is no part does not raise TypeError")
    require(raises(ValueError, split.append, "x", role="narrator"), "append() in an unknown role does not raise")
    require(_alike(model, split, whole), "a refused append() changes the conversation")


def check_counts(model: Model, frame: FrameRef) -> None:
    """Check that tokens are counted where the model says so, and not told where it does not.

    Raises:
        ContractError: names the clause that does not hold.
    """
    if not model.capabilities.counts_tokens:
        require(opened(model, frame, QUESTION).n_tokens is None, "n_tokens is not None though it counts no tokens")
        require(model.tokens_per_frame(frame) is None, "tokens_per_frame() is not None though it counts no tokens")
        return
    talk, sizes = model.conversation(), []
    for parts in ((frame,), (frame,), ("\nThe first frame.",), (frame, frame), (QUESTION,)):
        talk.append(*parts)
        sizes.append(talk.n_tokens or 0)
    require(sizes == sorted(set(sizes)), f"n_tokens does not grow with every part: {sizes}")
    per_frame = model.tokens_per_frame(frame) or 0
    require(0 < per_frame <= sizes[1] - sizes[0], "tokens_per_frame() is not within what a frame adds to n_tokens")


def check_turns(model: Model, frame: FrameRef) -> None:
    """Check that turns are told apart, and that only the user's is replied to.

    Raises:
        ContractError: names the clause that does not hold.
    """
    _check_nothing_to_reply_to(model.conversation(), "an empty conversation")
    talk = opened(model, frame, QUESTION)
    one = talk.n_tokens
    talk.append("A table.", role="assistant")
    _check_nothing_to_reply_to(talk, "a conversation whose last turn is the assistant's")
    talk.append("\nAre you sure?")
    talk.reply(GREEDY)
    require(one is None or one < (talk.n_tokens or 0), "n_tokens of three turns is not above that of the first")
    _check_system(model, frame)


def check_marks(model: Model, frame: FrameRef) -> None:
    """Check marks and rewinding.

    Raises:
        ContractError: names the clause that does not hold.
    """
    talk, as_it_was = opened(model, frame, QUESTION), opened(model, frame, QUESTION)
    early = talk.mark()
    talk.append(" More.")
    late = talk.mark()
    talk.rewind(early)
    require(_alike(model, talk, as_it_was), "rewind() does not bring back n_tokens or the reply")
    talk.append("Yes.", role="assistant")
    talk.append(" More and more.")
    require(raises(ValueError, talk.rewind, late), "rewind() to a mark behind the point rewound to does not raise")
    talk.rewind(early)
    require(_alike(model, talk, as_it_was), "a mark is good for one rewind() only")
    foreign = opened(model, frame).mark()
    require(raises(ValueError, talk.rewind, foreign), "rewind() to another conversation's mark does not raise")


def _check_nothing_to_reply_to(talk: Conversation, what: str) -> None:
    require(raises(ModelError, talk.reply, GREEDY), f"reply() to {what} does not raise ModelError")


def _check_system(model: Model, frame: FrameRef) -> None:
    talk = model.conversation()
    talk.append("Be brief.", role="system")
    _check_nothing_to_reply_to(talk, "a conversation whose last turn is the system's")
    talk.append(frame, QUESTION)
    try:
        talk.reply(GREEDY)
    except ModelError:
        return  # a model without system turns says so


def _alike(model: Model, one: Conversation, other: Conversation) -> bool:
    """Whether two conversations are the same, as far as the model lets it be seen."""
    if model.capabilities.counts_tokens:
        return one.n_tokens == other.n_tokens
    return not model.capabilities.deterministic or same(one.reply(GREEDY), other.reply(GREEDY))
