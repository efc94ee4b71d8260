"""Conversations of several turns, against transformers' own chat template, processor and
generate."""

import pytest

from infthor_eval.errors import ModelError
from model_adapters import Turn, load

from ..asking import load_saved, require_same, talk_of, up_to
from ..checkpoints import FAMILIES

NEW = 6
ADAPTERS = {family: family for family in FAMILIES} | dict.fromkeys(
    ("llava", "idefics3", "deepseek-vl-1.3b"), "hf-vlm"
)


@pytest.fixture(scope="module")
def conversations(frames):
    return [
        (
            Turn("user", (*frames[:2], "\nWhat is it?")),
            Turn("assistant", ("A mug.",)),
            Turn("user", ("\nAnd now?",)),
        ),
        (
            Turn("system", ("You wash cups.",)),
            Turn("user", ("Goal: ", frames[0], "MoveAhead", frames[1], "\nWhat now?")),
            Turn("assistant", ("RotateLeft",)),
            Turn("user", (frames[2], "\nAnd now?")),
            Turn("assistant", ("MoveAhead",)),
            Turn("user", ("So: ", frames[2], frames[3])),
        ),
    ]


@pytest.fixture(scope="module")
def plainly(checkpoints, conversations, answer_plainly):
    return answer_plainly({checkpoints[name]: conversations for name in ADAPTERS}, NEW)


@pytest.mark.parametrize("name", ADAPTERS)
@pytest.mark.parametrize("share_prefix", ["true", "false"])
def test_ids_and_replies_are_those_of_transformers(
    name, share_prefix, checkpoints, conversations, plainly
):
    options = {"dtype": "float32", "max_tokens": 0, "chunk_tokens": 50}
    model = load_saved(ADAPTERS[name], checkpoints[name], share_prefix=share_prefix, **options)
    for turns, (ids, reply) in zip(conversations, plainly[checkpoints[name]], strict=True):
        require_same(model, turns, ids, reply, NEW)
    model.close()


@pytest.mark.parametrize("family", FAMILIES)
def test_every_round_encodes_what_is_new_in_it_only(family, frames):
    shared = load(f"{family}-tiny", {"chunk_tokens": "40"}, seed=0)
    alone = load(f"{family}-tiny", {"share_prefix": "false"}, seed=0)
    talk, other = shared.conversation(), alone.conversation()
    n_context, cached = 0, []
    for frame, action in zip(
        frames, ("RotateLeft", "MoveAhead", "PickUp", "LookDown"), strict=False
    ):
        for each in (talk, other):
            each.append("Goal: wash. ", frame, "\nWhat next?")
        reply = talk.reply(up_to(NEW))
        assert reply.token_ids == other.reply(up_to(NEW)).token_ids
        # All of the last prompt is there, but for what tokens its last text makes with the first of
        # what was answered.
        assert reply.n_cached_tokens >= n_context - 2
        n_context = reply.n_context_tokens
        cached.append(reply.n_cached_tokens)
        for each in (talk, other):
            each.append(action, role="assistant")
    assert cached == sorted(set(cached))
    assert cached[-1] > 3 * shared.tokens_per_frame(frames[0])


def test_batches_go_on_from_several_turns(conversations):
    results = []
    for size in ("1", "3"):
        talk = talk_of(load("qwen2.5-vl-tiny", {"batch_size": size}, seed=0), conversations[1][:-1])
        replies = talk.replies(
            [["What?"], [*conversations[1][-1].parts], ["\nWhy not?"]], up_to(NEW)
        )
        results.append([(reply.text, reply.token_ids, reply.n_context_tokens) for reply in replies])
    assert results[0] == results[1]


@pytest.mark.parametrize("role", ["system", "assistant"])
def test_only_a_users_turn_is_replied_to(tiny, role):
    talk = tiny.conversation()
    for _ in range(2):
        with pytest.raises(
            ModelError, match=r"qwen2\.5-vl-tiny has nothing to reply to: .*; append a user turn"
        ):
            talk.reply(up_to(NEW))
        with pytest.raises(ModelError, match="append a user turn"):
            assert talk.n_tokens
        with pytest.raises(ModelError, match="append a user turn"):
            talk.replies([[]], up_to(NEW))
        talk.append("I see.", role=role)
    assert [reply.text for reply in talk.replies([["What?"]], up_to(2))] != []
