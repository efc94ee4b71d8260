"""Replies of real vLLM: token for token those of transformers, in float32 and greedy, for all
families."""

import pytest

from model_adapters import check_adapter

from ...asking import load_saved, up_to, user
from ..families import FAMILIES, TEXTS, adapter_of, facts


def _prompts(frames):
    return [
        ("What do you see?",),
        (frames[0], "\nWhat is it?"),
        ("First ", frames[1], " then ", frames[2], "?"),
        (*frames, "\nWhere is the mug?"),
        (*frames, "\nHow many apples are there?"),
    ]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("cached", [True, False])
def test_replies_are_those_of_transformers(family, cached, start, in_process, frames):
    ours = start(family, adapter_of(family), **({} if cached else {"prefix_caching": False}))
    theirs = in_process(family, adapter_of(family))
    for parts in _prompts(frames):
        replies = [model.answer(user(*parts), up_to(50)) for model in (ours, theirs)]
        assert facts(replies[0]) == facts(replies[1])


@pytest.mark.parametrize("model_type", ["llama", "gemma2", "gpt2"])
def test_language_models_reply_as_in_transformers(model_type, start, language_models):
    folder = language_models / model_type
    ours, theirs = start(name="hf-lm", pretrained=folder), load_saved("hf-lm", folder)
    for text in TEXTS:
        replies = [model.answer(user(text), up_to(50)) for model in (ours, theirs)]
        assert facts(replies[0]) == facts(replies[1])


_SMALL_STEPS = {
    "max_num_seqs": 2,
    "max_num_batched_tokens": 256,
    "block_size": 32,
    "mm_encoder_tp_mode": "data",
    "threads": 2,
}


@pytest.mark.parametrize("options", [_SMALL_STEPS, {"tensor_parallel_size": 2}])
def test_replies_in_small_steps_or_by_two_processes_are_the_same(
    options, start, in_process, frames
):
    models = (start(**options), in_process("qwen2.5-vl"))
    continuations = [[*parts] for parts in _prompts(frames)]
    replies = [model.conversation().replies(continuations, up_to(50)) for model in models]
    assert [facts(reply) for reply in replies[0]] == [facts(reply) for reply in replies[1]]


@pytest.mark.parametrize("family", ["qwen2.5-vl", "pixtral", "llava"])
def test_it_keeps_the_contract(family, start):
    check_adapter(start(family, adapter_of(family)), (84, 84))


def test_of_continuations_the_others_find_the_prefix_of_the_first(start, in_process, frames):
    continuations = [[f"\nQuestion {number}: what is it?"] for number in range(5)]
    models, replies = (start(), in_process("qwen2.5-vl")), []
    for model in models:
        talk = model.conversation()
        talk.append(*frames, "It is a long way. " * 40)
        replies.append(talk.replies(continuations, up_to(8)))
    assert [facts(reply) for reply in replies[0]] == [facts(reply) for reply in replies[1]]
    assert replies[0][0].n_cached_tokens == 0
    # A block of vLLM's on a CPU.
    assert all(reply.n_cached_tokens >= 128 for reply in replies[0][1:])


def test_a_reply_is_held_to_choices(start, in_process, frames):
    decoding = up_to(30, choices=("on the table", "in the sink", "in the fridge"))
    ours, theirs = start(), in_process("qwen2.5-vl")
    for frame in frames:
        turns = user(frame, "Where is the mug?")
        assert ours.answer(turns, decoding).text in decoding.choices
        assert theirs.answer(turns, decoding).text in decoding.choices


def test_a_stop_string_ends_and_cuts_the_reply_where_transformers_does(start, in_process, frames):
    ours, theirs, turns = start(), in_process("qwen2.5-vl"), user(frames[0], "Where?")
    # An untrained model writes halves of characters, too, which vLLM holds back and transformers
    # decodes.
    plain = [letter for letter in theirs.answer(turns, up_to(12)).text if letter.isascii()]
    for stop in (plain[2], plain[-1], "never"):
        replies = [
            model.answer(turns, up_to(12, stop=("not this", stop))) for model in (ours, theirs)
        ]
        assert facts(replies[0]) == facts(replies[1])


def test_draws_repeat_with_their_seed(start, frames):
    model, turns = start(), user(frames[0], "Say it.")
    replies = [
        model.answer(turns, up_to(20, temperature=1.5, top_p=0.9, seed=seed)).text
        for seed in (3, 4, 3)
    ]
    assert replies[0] == replies[2] != replies[1]


@pytest.mark.parametrize(
    ("family", "rope"), [("qwen2.5-vl", "yarn:4"), ("pixtral", "yarn:2"), ("pixtral", "linear:2")]
)
def test_an_extended_model_answers_as_in_transformers(family, rope, start, in_process, frames):
    ours, theirs = start(family, rope=rope), in_process(family, rope=rope)
    for parts in _prompts(frames):
        turns = user(*parts, "Where is the mug? " * 40)
        assert facts(ours.answer(turns, up_to(30))) == facts(theirs.answer(turns, up_to(30)))
    plain = in_process(family).answer(turns, up_to(30))
    assert facts(plain) != facts(theirs.answer(turns, up_to(30)))
