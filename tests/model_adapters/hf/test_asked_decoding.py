"""Draws and choices, the same whichever way a reply is computed."""

import pytest
from transformers import set_seed

from infthor_eval.errors import ModelError
from model_adapters import load
from model_adapters.hf.uncached import UncachedModel, process_turns

from ..asking import ask, load_saved, talk_of, up_to, user

PLACES = ("in the sink", "in the bin", "on the table", "on the table top", "on")


@pytest.fixture(scope="module")
def ways(checkpoints):
    """One checkpoint in every way it can be run."""
    options = {
        "shared": {"chunk_tokens": 20},
        "batched": {"batch_size": 4},
        "uncached": {"share_prefix": False},
    }
    return {
        way: load_saved("hf-vlm", checkpoints["llava"], dtype="float32", **chosen)
        for way, chosen in options.items()
    }


def _asked(frames):
    return [["\nWhere is the mug?"], [frames[2], "\nWhere is it?"], ["\nWhy?"], [frames[3]]]


def _replies(model, frames, decoding):
    talk = model.conversation()
    talk.append(*frames[:2])
    return [(reply.text, reply.token_ids) for reply in talk.replies(_asked(frames), decoding)]


DECODINGS = [
    up_to(12, temperature=1.0, seed=1),
    up_to(12, temperature=0.7, top_p=0.9, seed=2, stop=("e",)),
    up_to(12, choices=PLACES),
    up_to(12, choices=PLACES, temperature=2.0, seed=3),
]


@pytest.mark.parametrize("decoding", DECODINGS)
def test_every_way_of_running_gives_the_same_replies(ways, frames, decoding):
    assert isinstance(ways["uncached"], UncachedModel)
    results = {way: _replies(model, frames, decoding) for way, model in ways.items()}
    assert results["shared"] == results["batched"] == results["uncached"]


@pytest.mark.parametrize("way", ["shared", "batched", "uncached"])
def test_a_draw_hangs_on_its_seed_and_not_on_what_was_asked_before(ways, frames, way):
    model = ways[way]
    drawn = [_replies(model, frames, up_to(8, temperature=1.0, seed=seed)) for seed in (1, 2, 1)]
    assert drawn[0] == drawn[2] != drawn[1]
    set_seed(3)
    talk = model.conversation()
    talk.append(*frames[:2], *_asked(frames)[0])
    talk.reply(up_to(3, temperature=1.0, seed=9))
    reply = talk.reply(up_to(8, temperature=1.0, seed=1))
    assert (reply.text, reply.token_ids) == drawn[0][0]


@pytest.mark.parametrize("choices", [PLACES, PLACES[:2], PLACES[2:], ("no", "yes")])
def test_choices_are_those_that_generate_makes_under_the_same_constraint(ways, frames, choices):
    model = ways["uncached"]
    loaded, talk = model._loaded, talk_of(model, user(*frames[:2], "\nWhere is it?"))
    spelled = [loaded.tokenizer(text, add_special_tokens=False)["input_ids"] for text in choices]
    inputs = process_turns(model._processor, loaded.template, talk.turns)
    n_context = inputs["input_ids"].shape[1]

    def allowed(_, ids):
        begun = ids[n_context:].tolist()
        longer = [ids for ids in spelled if ids[: len(begun)] == begun and ids != begun]
        ends = loaded.generation.end_ids if begun in spelled else set()
        return sorted({ids[len(begun)] for ids in longer} | ends)

    output = loaded.model.generate(
        **inputs, do_sample=False, max_new_tokens=20, prefix_allowed_tokens_fn=allowed
    )
    expected = loaded.tokenizer.decode(output[0, n_context:], skip_special_tokens=True)
    assert talk.reply(up_to(20, choices=choices)).text == expected
    assert expected in choices


def test_what_is_said_in_choices_depends_on_what_is_asked(frames):
    model = load("qwen2.5-vl-tiny", {}, seed=0)
    decoding = up_to(12, choices=PLACES)
    said = {text for frame in frames for text, _ in _replies(model, [frame] * 4, decoding)}
    assert said <= set(PLACES)
    assert len(said) > 1


def test_a_stop_string_cuts_no_choice(ways, frames):
    held = {"choices": ("on the table",), "stop": ("the",)}
    assert ask(ways["shared"], frames[0], "\nWhere?", new=12, **held).text == "on the table"


def test_a_choice_that_cannot_be_said_in_so_few_tokens_is_refused(ways, frames):
    for model in ways.values():
        with pytest.raises(
            ModelError, match=r"the choice 'on the table top' has \d+ tokens and a reply may have 3"
        ):
            ask(model, frames[0], new=3, choices=("on", "on the table top"))


def test_replies_have_their_lengths(ways, frames):
    for model in ways.values():
        reply = ask(model, frames[0], "\nWhere?", new=5)
        assert reply.n_reply_tokens == len(reply.token_ids)
        assert reply.faults == ()
