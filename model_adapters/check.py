"""Contract checks that anyone can run on their own adapter.

They ask for behaviour through the protocols only, so they hold for every back end; each violated clause raises an
error of one line.
"""

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from model_adapters.protocols import BatchingConversation, Bound, Conversation, Model, Part, Reply

__all__ = ["ContractError", "check_adapter", "check_bound"]

_NEW_TOKENS = 8
_QUESTION = "\nQuestion: What do you see? Answer with a single word."


class ContractError(AssertionError):
    """An adapter broke a clause of its protocol; the message says which."""


def check_adapter(model: Model, frame_size: tuple[int, int] = (300, 300)) -> None:
    """Check a model against the contract of `Model` and `Conversation`.

    It makes about a dozen short replies on frames of one colour.

    Args:
        model: the adapter to check; it stays open.
        frame_size: width and height of the frames to show it, in pixels.

    Raises:
        ContractError: names the clause that does not hold.
    """
    _require(isinstance(model, Model), "the object lacks a member of the Model protocol")
    _require(isinstance(model.conversation(), Conversation), "conversation() lacks a member of the protocol")
    _check_identity(model)
    with tempfile.TemporaryDirectory() as folder:
        black, white = (_frame(Path(folder), name, frame_size) for name in ("black", "white"))
        _check_parts(model, black)
        _check_marks(model, black)
        _check_reply(model, black)
        _check_frames(model, black, white)
        _check_sharing(model, black, white)
        _check_batching(model, black, white)


def check_bound(bound: Bound, questions: Sequence[Question]) -> None:
    """Check a bound against the contract of `Bound`.

    Args:
        bound: the bound to check; it studies the questions.
        questions: an answer key, at least one question.

    Raises:
        ContractError: names the clause that does not hold.
    """
    _require(isinstance(bound, Bound), "the object lacks a member of the Bound protocol")
    _check_identity(bound)
    bound.study(questions)
    there = [bound.answer(question) for question in questions]
    back = [bound.answer(question) for question in reversed(questions)][::-1]
    _require(all(isinstance(answer, str) for answer in there), "an answer is not a str")
    _require(there == back, "answers depend on the order of asking")


def _require(holds: bool, clause: str) -> None:
    if not holds:
        raise ContractError(clause)


def _check_identity(model: Model | Bound) -> None:
    identity = model.identity()
    try:
        again = json.loads(json.dumps(identity))
    except TypeError as error:
        raise ContractError(f"identity() is not made of JSON values: {error}") from error
    _require(again == identity, "identity() changes when written as JSON and read back")
    _require(model.identity() == identity, "identity() differs from call to call")
    _require(bool(model.name), "the name is empty")


def _check_parts(model: Model, frame: FrameRef) -> None:
    talk = model.conversation()
    sizes = [talk.n_tokens]
    for parts in ((frame,), ("\nThe first frame.",), (frame, frame), (_QUESTION,)):
        talk.append(*parts)
        sizes.append(talk.n_tokens)
    _require(sizes == sorted(set(sizes)), f"n_tokens does not grow with every part: {sizes}")
    per_frame = model.tokens_per_frame(frame)
    _require(0 < per_frame <= sizes[1] - sizes[0], "tokens_per_frame() is not within what a frame adds to n_tokens")
    split, whole = _opened(model, frame, "\nWhat do", " you see?"), _opened(model, frame, "\nWhat do you see?")
    _require(split.n_tokens == whole.n_tokens, "a text appended in two pieces differs from the same text in one")
    _require(_raises(TypeError, talk.append, 3), "append() of something that is no part does not raise TypeError")
    _require(talk.n_tokens == sizes[-1], "a refused append() changes the conversation")


def _check_marks(model: Model, frame: FrameRef) -> None:
    talk = _opened(model, frame)
    early, size = talk.mark(), talk.n_tokens
    talk.append(" More.")
    late = talk.mark()
    talk.rewind(early)
    _require(talk.n_tokens == size, "rewind() does not bring back n_tokens")
    talk.append(" More and more.")
    _require(_raises(ValueError, talk.rewind, late), "rewind() to a mark behind the point rewound to does not raise")
    talk.rewind(early)
    _require(talk.n_tokens == size, "a mark is good for one rewind() only")
    foreign = _opened(model, frame).mark()
    _require(_raises(ValueError, talk.rewind, foreign), "rewind() to another conversation's mark does not raise")


def _check_reply(model: Model, frame: FrameRef) -> None:
    talk = _opened(model, frame, _QUESTION)
    size = talk.n_tokens
    first = talk.reply(_NEW_TOKENS)
    _require(isinstance(first, Reply), "reply() does not return a Reply")
    _require(first.n_context_tokens == size, "n_tokens before a reply is not the reply's n_context_tokens")
    _require(0 <= first.n_cached_tokens < size, "n_cached_tokens is not between 0 and the context")
    _require(len(first.token_ids) <= _NEW_TOKENS, "a reply has more tokens than max_new_tokens")
    _require(talk.n_tokens == size, "reply() changes the conversation")
    _require(_same(first, talk.reply(_NEW_TOKENS)), "the same question is not answered the same way twice")
    short = talk.reply(1)
    _require(short.token_ids == first.token_ids[:1], "a shorter reply is not the start of a longer one")
    _require(_raises(ValueError, talk.reply, 0), "reply(0) does not raise ValueError")
    _check_stop(talk, first)


def _check_stop(talk: Conversation, whole: Reply) -> None:
    if len(whole.text) < 2:
        return
    stop = whole.text[len(whole.text) // 2 :]
    cut = talk.reply(_NEW_TOKENS, stop=(stop,)).text
    _require(cut == whole.text[: whole.text.index(stop)], "a stop string and what follows it are not cut off")


def _check_frames(model: Model, black: FrameRef, white: FrameRef) -> None:
    # One reply could be the same by chance; of several questions on the two frames, one must differ.
    asked = [_QUESTION, "\nIs it bright or dark?", "\nWhat colour is it?", "\nDescribe the picture."]
    differ = any(
        not _same(*(_opened(model, frame, text).reply(_NEW_TOKENS) for frame in (black, white))) for text in asked
    )
    _require(differ, "a black and a white frame get the same replies: the model does not see the frames")


def _check_sharing(model: Model, black: FrameRef, white: FrameRef) -> None:
    talk = _opened(model, black, white)
    start = talk.mark()
    shared = []
    for text in (_QUESTION, "\nWhat colour was the first frame?"):
        talk.append(text)
        shared.append(talk.reply(_NEW_TOKENS))
        talk.rewind(start)
    _opened(model, white, "\nSomething else.").reply(1)  # whatever the back end has kept is of no use after this
    fresh = _opened(model, black, white, "\nWhat colour was the first frame?").reply(_NEW_TOKENS)
    _require(_same(shared[1], fresh), "a reply after a rewind differs from that of a fresh conversation")


def _check_batching(model: Model, black: FrameRef, white: FrameRef) -> None:
    talk = _opened(model, black)
    if not isinstance(talk, BatchingConversation):
        return
    endings: list[list[Part]] = [[_QUESTION], [white, "\nWhat colours are the frames?"], ["\nWhy?"]]
    size, together = talk.n_tokens, talk.replies(endings, _NEW_TOKENS)
    _require(talk.n_tokens == size, "replies() changes the conversation")
    alone = [_opened(model, black, *ending).reply(_NEW_TOKENS) for ending in endings]
    _require(len(together) == len(alone), "replies() does not give one reply per ending")
    _require(all(map(_same, together, alone)), "replies() differs from asking one by one")
    _require(_raises(ValueError, talk.replies, endings, 0), "replies() of 0 tokens does not raise ValueError")


def _opened(model: Model, *parts: Part) -> Conversation:
    talk = model.conversation()
    talk.append(*parts)
    return talk


def _same(one: Reply, other: Reply) -> bool:
    return (one.text, one.token_ids) == (other.text, other.token_ids)


def _raises(kind: type[Exception], call: Any, *args: Any) -> bool:
    try:
        call(*args)
    except kind:
        return True
    return False


def _frame(folder: Path, colour: str, size: tuple[int, int]) -> FrameRef:
    path = folder / f"{colour}.png"
    Image.new("RGB", size, colour).save(path)
    return FrameRef(path)
