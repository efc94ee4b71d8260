"""Several continuations of one prefix, answered together, against the same asked one by one."""

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters import load
from model_adapters.hf.prompting.prompt import n_common, n_nested

from ...asking import ask, talk_of, up_to, user

CONTINUATION = st.lists(
    st.one_of(
        st.sampled_from(["\nWhat", " is it?", "mug ", "\nQuestion: where was the apple?"]),
        st.integers(0, 5),
    ),
    max_size=4,
)


@pytest.fixture(scope="module")
def batching():
    return load("qwen2.5-vl-tiny", {"batch_size": "3", "chunk_tokens": "30"}, seed=0)


def _parts(continuation, frames):
    return [frames[part] if isinstance(part, int) else part for part in continuation]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    start=CONTINUATION.filter(len),
    continuations=st.lists(CONTINUATION, min_size=1, max_size=7),
    stop=st.sampled_from([(), ("e", "o")]),
)
def test_replies_are_those_of_asking_one_by_one(batching, tiny, frames, start, continuations, stop):
    talk = batching.conversation()
    talk.append(*_parts(start, frames))
    together = talk.replies(
        [_parts(continuation, frames) for continuation in continuations], up_to(5, stop=stop)
    )
    for continuation, reply in zip(continuations, together, strict=True):
        parts = (*_parts(start, frames), *_parts(continuation, frames))
        expected = ask(tiny, *parts, new=5, stop=stop)
        assert (reply.text, reply.token_ids) == (expected.text, expected.token_ids)
        assert reply.n_context_tokens == expected.n_context_tokens


NESTED = st.lists(
    st.tuples(st.integers(0, 6), st.sampled_from(["\nWhat?", "\nWhere was it then?", "mug"])),
    min_size=2,
    max_size=7,
)


@pytest.mark.parametrize("name", ["qwen2.5-vl-tiny", "pixtral-tiny", "llava-onevision-tiny"])
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(asked=NESTED)
def test_beginnings_of_one_context_are_answered_together_as_one_by_one(name, asked, models, frames):
    together, alone = models[name]
    shown = [*frames, *frames[:1]]
    contexts = [[*shown[:n], text] for n, text in asked]
    replies = together.conversation().replies(contexts, up_to(5))
    for context, reply in zip(contexts, replies, strict=True):
        expected = ask(alone, *context, new=5)
        assert (reply.text, reply.token_ids) == (expected.text, expected.token_ids)
        assert reply.context_hash == expected.context_hash
        assert reply.frames_hash == expected.frames_hash


@pytest.fixture(scope="module")
def models():
    """Models that answer several together, and those that encode every prompt as a whole."""
    options = {"batch_size": "5", "chunk_tokens": "30"}
    return {
        name: (load(name, options, seed=0), load(name, {"share_prefix": "false"}, seed=0))
        for name in ("qwen2.5-vl-tiny", "pixtral-tiny", "llava-onevision-tiny")
    }


def test_the_longest_context_is_encoded_once_for_all_its_beginnings(batching, frames):
    contexts = [[*frames[:n], "\nIs it here?"] for n in (2, 4, 6)]
    replies = batching.conversation().replies(contexts, up_to(2))
    assert [reply.n_cached_tokens for reply in replies][1:] == sorted(
        reply.n_cached_tokens for reply in replies[1:]
    )
    per_frame = batching.tokens_per_frame(frames[0])
    for reply in replies[1:]:
        assert reply.n_context_tokens - reply.n_cached_tokens < per_frame + 30


@pytest.mark.parametrize(
    ("prompts", "shared"),
    [
        ([["a", 1, 2], ["a", "b", 1, 2], ["a", "b", 1, 3]], [1, 3, 3]),
        ([["a", 1], ["b", 1]], []),
        ([["a", "b", 1], ["b", 1]], []),
        ([[1, 2], ["a", 1, 2]], [0, 2]),
        ([["a", 1, 2], ["a", 1, 3]], [2, 2]),
    ],
)
def test_which_prompts_are_beginnings_of_the_one_with_most_frames(prompts, shared):
    assert n_nested(prompts) == shared


def test_a_window_slides_over_the_prefix_and_each_continuation(frames):
    heard = []
    for size, window in (("8", 20), ("1", 20), ("1", None)):
        model = load("pixtral-tiny", {"batch_size": size, "chunk_tokens": "30"}, seed=0)
        model._loaded.model.get_decoder().config.sliding_window = window
        talk = model.conversation()
        talk.append(
            *frames[:2], "\nWhere was the mug before it was put into the sink of the kitchen?"
        )
        continuations = [
            ["\nOne."],
            ["\nOr was it the plate on the table, which is larger than the window is wide?"],
        ]
        heard.append([reply.token_ids for reply in talk.replies(continuations, up_to(8))])
    assert heard[0] == heard[1] != heard[2]


def test_a_model_that_does_not_attend_by_the_interface_is_refused_or_asked_alone(frames):
    model = load("qwen2.5-vl-tiny", {}, seed=0)
    talk = model.conversation()
    talk.append(frames[0])
    assert model.capabilities.batch_size == 64  # the model has been asked how it attends
    decoder = model._loaded.model.get_decoder()
    decoder.config.num_hidden_layers += 1  # as if a layer did something else
    with pytest.raises(
        ModelError, match="do not all attend by transformers' interface; set batch_size=1"
    ):
        talk.replies([["\nWhat?"], ["\nWho?"]], up_to(2))
    other = load("qwen2.5-vl-tiny", {}, seed=0)
    other._loaded.model.get_decoder().config.num_hidden_layers += 1
    assert other.capabilities.batch_size == 1
    decoder.config.num_hidden_layers -= 1
    assert len(talk.replies([["\nWhat?"], ["\nWho?"]], up_to(2))) == 2
    assert (
        load("qwen2.5-vl-tiny", {"attn_implementation": "eager"}, seed=0).capabilities.batch_size
        == 1
    )


def test_the_prefix_is_encoded_once_for_all(batching, frames):
    talk = batching.conversation()
    talk.append(*frames[::-1])
    replies = talk.replies([[f"\nIs number {number} here?"] for number in range(6)], up_to(2))
    assert replies[0].n_cached_tokens < 50
    assert all(reply.n_cached_tokens > 60 for reply in replies[1:])


def test_penalties_are_each_rows_own(frames):
    replies = []
    for size in ("1", "4"):
        model = load("qwen2.5-vl-tiny", {"batch_size": size}, seed=1)
        loaded = model._loaded
        model._loaded = replace(
            loaded, generation=replace(loaded.generation, repetition_penalty=1.4)
        )
        talk = talk_of(model, user(frames[0]))
        answers = talk.replies([["mug"], ["\nWhere?"], ["\nWhy not?"]], up_to(40))
        replies.append([reply.token_ids for reply in answers])
    assert replies[0] == replies[1]


def test_no_ending_no_reply(batching):
    assert batching.conversation().replies([], up_to(3)) == []


def test_one_that_does_not_fit_is_refused_before_any_is_answered(frames):
    model = load("qwen2.5-vl-tiny", {"batch_size": "2", "max_tokens": "60"}, seed=0)
    talk = model.conversation()
    with pytest.raises(ModelError, match="beyond the 60 tokens"):
        talk.replies([["short"], [*frames]], up_to(2))


@pytest.mark.parametrize(
    ("prompts", "common"),
    [([[1, 2, 3], [1, 2, 4]], 2), ([[1, 2, 3], [1, 2]], 1), ([[1], [2]], 0), ([[1, 2], [1, 2]], 1)],
)
def test_what_prompts_have_in_common_leaves_a_piece_of_each(prompts, common):
    assert n_common(prompts) == common
