"""Checks that a model does what its capabilities claim, and refuses what they do not.

Each check raises `ContractError`, which names the clause that does not hold.
"""

from concurrent.futures import ThreadPoolExecutor

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.check.clauses import (
    GREEDY,
    NEW_TOKENS,
    QUESTION,
    ask,
    raises,
    require,
    same_reply,
    start_conversation,
)
from model_adapters.protocols import Decoding, Model, Reply

_MOST_THREADS = 4
_CHOICES = ("bright", "dark", "dark and bright")  # one is a prefix of another


def check_sampling(model: Model, frame: FrameRef) -> None:
    """Check that replies are sampled if the model claims to, and depend on the seed alone if it is
    deterministic."""
    decodings = [
        Decoding(max_new_tokens=NEW_TOKENS, temperature=2.0, seed=seed) for seed in range(4)
    ]
    talk = start_conversation(model, frame, "\nDescribe the picture.")
    if not model.capabilities.sampling:
        refuses = raises(ModelError, talk.reply, decodings[0])
        require(
            refuses,
            "a temperature does not raise ModelError though sampling is false; call check_decoding "
            "first",
        )
        return
    replies = [talk.reply(decoding) for decoding in decodings]
    require(
        any(not same_reply(replies[0], other) for other in replies),
        "no seed changes a reply at temperature 2",
    )
    if model.capabilities.deterministic:
        again = [talk.reply(decoding) for decoding in reversed(decodings)][::-1]
        require(all(map(same_reply, replies, again)), "the same seed does not give the same reply")


def check_choices(model: Model, frame: FrameRef) -> None:
    """Check that replies are restricted to choices if the model claims to support them."""
    decoding = Decoding(max_new_tokens=64, choices=_CHOICES)
    talk = start_conversation(model, frame, QUESTION)
    if not model.capabilities.choices:
        refuses = raises(ModelError, talk.reply, decoding)
        require(
            refuses,
            "choices do not raise ModelError though choices is false; call check_decoding first",
        )
        return
    for choices in (_CHOICES, _CHOICES[1:], _CHOICES[:1]):
        text = talk.reply(Decoding(max_new_tokens=64, choices=choices)).text
        require(text in choices, f"a reply is none of its choices: {text!r}")


def check_video(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that videos are taken if the model claims so, and that replies to them do not depend on
    earlier ones."""
    videos = [
        Video((black, white, white, black), fps=1.0),
        Video((black, white, white, white), fps=1.0),
    ]
    if not model.capabilities.video_input:
        refuses = raises(ModelError, start_conversation(model, videos[0], QUESTION).reply, GREEDY)
        require(
            refuses,
            "a video does not raise ModelError though video_input is false; call check_turns first",
        )
        return
    talks = [start_conversation(model, video, QUESTION) for video in videos]
    if model.capabilities.counts_tokens:
        without = start_conversation(model, QUESTION).n_tokens or 0
        within = talks[0].n_tokens or 0
        require(within > without, "n_tokens does not grow with a video")
    replies = [talk.reply(GREEDY) for talk in talks]
    if model.capabilities.deterministic:
        again = [talk.reply(GREEDY) for talk in reversed(talks)][::-1]
        require(
            all(map(same_reply, replies, again)),
            "a reply to a video depends on the videos before it",
        )


def check_flight(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that several conversations can be answered at the same time if the model claims so."""
    n_threads = min(model.capabilities.max_in_flight, _MOST_THREADS)
    if n_threads == 1:
        return
    questions = [
        (frame, f"\nWhat is picture {number}?")
        for number in range(n_threads)
        for frame in (black, white)
    ]

    def answer(parts: tuple[FrameRef, str]) -> Reply:
        return ask(model, *parts)

    with ThreadPoolExecutor(n_threads) as pool:
        together = list(pool.map(answer, questions))
    alike = not model.capabilities.deterministic or all(
        map(same_reply, together, map(answer, questions))
    )
    require(alike, "replies to questions asked at the same time differ from those asked one by one")
