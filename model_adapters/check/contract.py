"""The contract of models and policies, checked up to the first violation or as a whole.

A check raises `ContractError`, which names the clause that does not hold. Checks are of replies,
of conversations (parts, turns, marks and token counts), and of what capabilities claim.
"""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import cast

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from model_adapters.check.clauses import (
    GREEDY,
    NEW_TOKENS,
    QUESTION,
    ask,
    check_identity,
    check_members,
    frames_of_one_colour,
    require,
    require_error,
    require_same,
    same_reply,
    start_conversation,
)
from model_adapters.check.results import CheckResult, run_each
from model_adapters.frame_policies import with_episodes
from model_adapters.protocols import (
    ArmDelta,
    ArmObservation,
    Conversation,
    Decoding,
    Episode,
    FramePolicy,
    HandState,
    Model,
    Part,
    Policy,
    Reply,
)

_MOST_THREADS = 4
_CHOICES = ("bright", "dark", "dark and bright")  # one is a prefix of another
_INSTRUCTION = "pick up the mug"
_TEXTS = ("A black picture.", "A white picture.")


def check_adapter(
    adapter: Model | Policy | FramePolicy, frame_size: tuple[int, int] = (300, 300)
) -> None:
    """Check a model or a policy against its contract, as far as its capabilities go.

    The adapter answers a few dozen short questions on frames of one colour.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.

    Raises:
        ContractError: a clause does not hold; the message names it.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        for check in _checks(adapter, black, white).values():
            check()


def run_checks(
    adapter: Model | Policy | FramePolicy, frame_size: tuple[int, int] = (300, 300)
) -> Iterator[CheckResult]:
    """Run all checks of `check_adapter`, also after a violation; only a missing member ends them.

    Args:
        adapter: the adapter to check; it is not closed.
        frame_size: width and height of the frames, in pixels.
    """
    with frames_of_one_colour(frame_size) as (black, white):
        yield from run_each(_checks(adapter, black, white))


def _checks(
    adapter: Model | Policy | FramePolicy, black: FrameRef, white: FrameRef
) -> dict[str, Callable[[], None]]:
    if hasattr(adapter, "act"):
        return policy_checks(cast(Policy | FramePolicy, adapter), black, white)
    return model_checks(adapter, black, white)


def model_checks(model: Model, black: FrameRef, white: FrameRef) -> dict[str, Callable[[], None]]:
    """Return all checks of a model by name; each raises `ContractError` for a broken clause."""
    return {
        "members": partial(check_members, model),
        "identity": partial(check_identity, model),
        "parts": partial(_show, _check_parts, model, black),
        "counts": partial(_show, _check_counts, model, black),
        "marks": partial(_show, _check_marks, model, black),
        "reply": partial(_show, _check_reply, model, black),
        "turns": partial(_show, _check_turns, model, black),
        "frames": partial(_check_frames, model, black, white),
        "sharing": partial(_show, _check_sharing, model, black, white),
        "continuations": partial(_show, _check_continuations, model, black, white),
        "sampling": partial(_show, _check_sampling, model, black),
        "choices": partial(_show, _check_choices, model, black),
        "video": partial(_check_video, model, black, white),
        "flight": partial(_show, _check_flight, model, black, white),
    }


def _show(check: Callable[..., None], model: Model, *frames: FrameRef) -> None:
    """Run a check on frames, or on texts in their place for a model that reads text alone."""
    check(model, *(frames if model.capabilities.image_input else _TEXTS[: len(frames)]))


def _check_sampling(model: Model, frame: Part) -> None:
    """Check that replies are sampled if the model claims to, and depend on the seed alone if it is
    deterministic."""
    decodings = [
        Decoding(max_new_tokens=NEW_TOKENS, temperature=2.0, seed=seed) for seed in range(4)
    ]
    talk = start_conversation(model, frame, "\nDescribe the picture.")
    if not model.capabilities.sampling:
        clause = "a temperature does not raise ModelError though sampling is false"
        require_error(f"{clause}; call check_decoding first", ModelError, talk.reply, decodings[0])
        return
    replies = [talk.reply(decoding) for decoding in decodings]
    require(
        any(not same_reply(replies[0], other) for other in replies),
        "no seed changes a reply at temperature 2",
    )
    again = map(talk.reply, reversed(decodings))
    require_same(model, replies[::-1], again, "the same seed does not give the same reply")


def _check_choices(model: Model, frame: Part) -> None:
    """Check that replies are restricted to choices if the model claims to support them."""
    decoding = Decoding(max_new_tokens=64, choices=_CHOICES)
    talk = start_conversation(model, frame, QUESTION)
    if not model.capabilities.choices:
        clause = "choices do not raise ModelError though choices is false"
        require_error(f"{clause}; call check_decoding first", ModelError, talk.reply, decoding)
        return
    for choices in (_CHOICES, _CHOICES[1:], _CHOICES[:1]):
        text = talk.reply(Decoding(max_new_tokens=64, choices=choices)).text
        require(text in choices, f"a reply is none of its choices: {text!r}")


def _check_video(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that videos are taken if the model claims so, and that replies to them do not depend on
    earlier ones."""
    videos = [
        Video((black, white, white, black), fps=1.0),
        Video((black, white, white, white), fps=1.0),
    ]
    if not model.capabilities.video_input:
        clause = "a video does not raise ModelError though video_input is false"
        talk = start_conversation(model, videos[0], QUESTION)
        require_error(f"{clause}; call check_turns first", ModelError, talk.reply, GREEDY)
        return
    talks = [start_conversation(model, video, QUESTION) for video in videos]
    if model.capabilities.counts_tokens:
        without = start_conversation(model, QUESTION).n_tokens or 0
        within = talks[0].n_tokens or 0
        require(within > without, "n_tokens does not grow with a video")
    replies = [talk.reply(GREEDY) for talk in talks]
    again = (talk.reply(GREEDY) for talk in reversed(talks))
    require_same(model, replies[::-1], again, "a reply to a video depends on the videos before it")


def _check_flight(model: Model, black: Part, white: Part) -> None:
    """Check that several conversations can be answered at the same time if the model claims so."""
    n_threads = min(model.capabilities.max_in_flight, _MOST_THREADS)
    if n_threads == 1:
        return
    questions = [
        (frame, f"\nWhat is picture {number}?")
        for number in range(n_threads)
        for frame in (black, white)
    ]

    def answer(parts: tuple[Part, str]) -> Reply:
        return ask(model, *parts)

    with ThreadPoolExecutor(n_threads) as pool:
        together = list(pool.map(answer, questions))
    clause = "replies to questions asked at the same time differ from those asked one by one"
    require_same(model, together, map(answer, questions), clause)


def _check_parts(model: Model, frame: Part) -> None:
    """Check that texts and frames can be appended, and nothing else."""
    split = start_conversation(model, frame, "\nWhat do", " you see?")
    whole = start_conversation(model, frame, "\nWhat do you see?")
    require(
        _alike(model, split, whole),
        "a text appended in two pieces differs from the same text in one",
    )
    clause = "append() of neither text nor frame does not raise TypeError"
    require_error(clause, TypeError, split.append, 3)
    clause = "append() in an unknown role does not raise"
    require_error(clause, ValueError, split.append, "x", role="narrator")
    require(_alike(model, split, whole), "a refused append() changes the conversation")


def _check_counts(model: Model, frame: FrameRef | str) -> None:
    """Check that token counts are exact if the model claims so, and None if it does not; those of a
    frame only where there are frames."""
    if not model.capabilities.counts_tokens:
        n_tokens = start_conversation(model, frame, QUESTION).n_tokens
        require(n_tokens is None, "n_tokens is not None though counts_tokens is false")
        require(
            isinstance(frame, str) or model.tokens_per_frame(frame) is None,
            "tokens_per_frame() is not None though counts_tokens is false",
        )
        return
    talk = model.conversation()
    sizes = []
    for parts in ((frame,), (frame,), ("\nThe first frame.",), (frame, frame), (QUESTION,)):
        talk.append(*parts)
        sizes.append(talk.n_tokens or 0)
    require(sizes == sorted(set(sizes)), f"n_tokens does not grow with every part: {sizes}")
    if isinstance(frame, str):
        return
    per_frame = model.tokens_per_frame(frame) or 0
    require(
        0 < per_frame <= sizes[1] - sizes[0],
        "tokens_per_frame() is not within what a frame adds to n_tokens",
    )


def _check_turns(model: Model, frame: Part) -> None:
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


def _check_marks(model: Model, frame: Part) -> None:
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
    clause = "rewind() to a mark behind the point rewound to does not raise"
    require_error(clause, ValueError, talk.rewind, late)
    talk.rewind(early)
    require(_alike(model, talk, unchanged), "a second rewind() to the same mark fails")
    foreign = start_conversation(model, frame).mark()
    clause = "rewind() to another conversation's mark does not raise"
    require_error(clause, ValueError, talk.rewind, foreign)


def _check_nothing_to_reply_to(talk: Conversation, what: str) -> None:
    clause = f"reply() to {what} does not raise ModelError; call check_turns first"
    require_error(clause, ModelError, talk.reply, GREEDY)


def _check_system(model: Model, frame: Part) -> None:
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


def policy_checks(
    policy: Policy | FramePolicy, black: FrameRef, white: FrameRef
) -> dict[str, Callable[[], None]]:
    """Return all checks of a policy by name; each raises `ContractError` for a broken clause."""
    return {
        "members": partial(check_members, policy),
        "identity": partial(check_identity, policy),
        "episodes": partial(_check_episodes, policy, (black, white)),
    }


def _check_episodes(policy: Policy | FramePolicy, frames: tuple[FrameRef, ...]) -> None:
    """Check that an episode is the same alone, again, and after another one."""
    acting = with_episodes(policy)
    alone = _run_episode(acting, _INSTRUCTION, frames)
    again = _run_episode(acting, _INSTRUCTION, frames)
    _run_episode(acting, "put the bowl in the sink", (*frames[::-1], *frames))
    after = _run_episode(acting, _INSTRUCTION, frames)
    if policy.capabilities.deterministic:
        require(alone == again, "the same episode again does not have the same actions")
        require(
            alone == after,
            "an episode after another does not have the actions that it has alone: something of "
            "the other is left when it begins",
        )


def _run_episode(
    policy: Policy, instruction: str, frames: tuple[FrameRef, ...]
) -> list[tuple[ArmDelta, ...]]:
    policy.begin(Episode("check", instruction, len(frames)))
    chunks = []
    for step, frame in enumerate(frames):
        state = HandState((0.4, 0.0, 0.3), (0.0, 0.0, 0.0), 1.0)
        chunks.append(policy.act(ArmObservation(frame, frame, state, step)))
        _check_chunk(chunks[-1])
    policy.end(success=False)
    return chunks


def _check_chunk(chunk: tuple[ArmDelta, ...]) -> None:
    require(
        isinstance(chunk, tuple) and len(chunk) > 0,
        "act() does not return a tuple of at least one ArmDelta",
    )
    for step in chunk:
        require(isinstance(step, ArmDelta), "a step of act() is not an ArmDelta")
        require(
            len(step.translation) == len(step.rotation) == 3,
            "a translation or rotation is not three numbers",
        )
        numbers = (*step.translation, *step.rotation, step.gripper)
        finite = all(isinstance(number, float) and math.isfinite(number) for number in numbers)
        require(finite, f"a step of act() is not made of finite floats: {step}")
        require(
            0 <= step.gripper <= 1,
            f"the gripper is not between 0 (closed) and 1 (open): {step.gripper}",
        )


def _check_reply(model: Model, frame: Part) -> None:
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


def _check_frames(model: Model, black: FrameRef, white: FrameRef) -> None:
    """Check that the model sees the frames, or refuses them if it reads text alone."""
    if not model.capabilities.image_input:
        clause = "a frame does not raise ModelError though image_input is false"
        talk = start_conversation(model, black, QUESTION)
        require_error(f"{clause}; call check_turns first", ModelError, talk.reply, GREEDY)
        return
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


def _check_sharing(model: Model, black: Part, white: Part) -> None:
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
    clause = "a reply after a rewind differs from that of a new conversation"
    require_same(model, shared[1:], [fresh], clause)


def _check_continuations(model: Model, black: Part, white: Part) -> None:
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
    require_same(model, together, alone, "replies() differs from asking one by one")
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
