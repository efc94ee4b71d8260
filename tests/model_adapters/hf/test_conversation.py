"""What a conversation feeds to the model and gets from it, against transformers' own plain path."""

from dataclasses import replace

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import check_adapter, load

from ..asking import ask, require_same, talk_of, up_to, user

NEW = 6


def _inputs(model, parts):
    """What transformers' processor makes of it: placeholders expanded in the text, then tokenised
    as a whole."""
    loaded = model._loaded
    content = [
        {"type": "text", "text": p} if isinstance(p, str) else {"type": "image"} for p in parts
    ]
    text = loaded.tokenizer.apply_chat_template(
        [{"role": "user", "content": content}],
        chat_template=loaded.template,
        tokenize=False,
        add_generation_prompt=True,
    )
    images = [part.load() for part in parts if isinstance(part, FrameRef)]
    processor = loaded.family._image_processor
    inputs = dict(processor(images=images, return_tensors="pt")) if images else {}
    pieces = text.split("<|image_pad|>")
    counts = [int(grid.prod()) // 4 for grid in inputs.get("image_grid_thw", [])]
    for index, count in enumerate(counts):
        pieces[index] += "<|image_pad|>" * count
    ids = loaded.tokenizer("".join(pieces), add_special_tokens=False, return_tensors="pt")[
        "input_ids"
    ]
    token_types = (ids == loaded.model.config.image_token_id).int()
    return inputs | {
        "input_ids": ids,
        "attention_mask": torch.ones_like(ids),
        "mm_token_type_ids": token_types,
    }


def _parts(frames):
    return [
        [*frames[:4], "\nDid you see a mug?"],
        [
            "Goal: wash the cup.",
            frames[0],
            "RotateLeft",
            frames[1],
            frames[1],
            "MoveAhead",
            frames[2],
            "\nWhat now?",
        ],
        ["no frame at all"],
        [frames[0]],
        ["Prägung — 漢字 \n\n  <|im_end|> x", frames[3]],
    ]


@pytest.mark.parametrize("case", range(5))
def test_ids_and_replies_are_those_of_the_chat_template_on_the_whole_and_generate(
    tiny, frames, case
):
    parts = _parts(frames)[case]
    inputs = _inputs(tiny, parts)
    output = tiny._loaded.model.generate(**inputs, do_sample=False, max_new_tokens=NEW)[0].tolist()
    n = inputs["input_ids"].shape[1]
    require_same(tiny, user(*parts), output[:n], output[n:], NEW)


def test_logits_are_those_of_a_plain_forward_pass(tiny, frames):
    parts = ["Goal.", *frames[:3], "\nWhat now?", frames[3], "so?"]
    pieces = tiny.pieces(user(*parts))
    prefix = tiny._prefix
    prefix.reset()
    prefix.feed(pieces[:30])
    prefix.cut(17)
    logits = prefix.feed(pieces[17:])
    with torch.inference_mode():
        expected = tiny._loaded.model(**_inputs(tiny, parts)).logits[0, -1]
    torch.testing.assert_close(logits, expected, atol=1e-4, rtol=1e-4)


def test_a_penalised_reply_is_that_of_generate(frames):
    model = load("qwen2.5-vl-tiny", {}, seed=1)
    parts = [*frames[:2], "\nWhat do you see?"]
    inputs = _inputs(model, parts)
    config = model._loaded.model.generation_config
    config.repetition_penalty = 1.3
    output = model._loaded.model.generate(**inputs, do_sample=False, max_new_tokens=12)

    model._loaded = replace(
        model._loaded, generation=replace(model._loaded.generation, repetition_penalty=1.3)
    )
    new = output[0, inputs["input_ids"].shape[1] :].tolist()
    assert list(ask(model, *parts, new=12).token_ids) == new
    assert model.identity()["generation"]["repetition_penalty"] == 1.3


STEPS = st.lists(
    st.one_of(
        st.tuples(
            st.just("text"),
            st.sampled_from(["mug", " on", " the table", "\nQuestion: ", "Mo", "veAhead"]),
        ),
        st.tuples(st.just("frame"), st.integers(0, 5)),
        st.tuples(st.just("answer"), st.sampled_from(["mug", " table.", "MoveAhead\n"])),
        st.tuples(st.just("mark"), st.just(0)),
        st.tuples(st.just("rewind"), st.integers(0, 3)),
        st.tuples(st.just("reply"), st.integers(1, 4)),
        st.tuples(st.just("fresh"), st.just(0)),
    ),
    min_size=3,
    max_size=14,
)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(steps=STEPS)
def test_sharing_changes_no_reply(tiny, plain, frames, steps):
    def play(model):
        talk, marks, heard = model.conversation(), [], []
        for step, value in [*steps, ("reply", 3)]:
            if step == "text":
                talk.append(value)
            elif step == "frame":
                talk.append(frames[value])
            elif step == "mark":
                marks.append(talk.mark())
            elif step == "rewind" and marks:
                del marks[value + 1 :]
                talk.rewind(marks[-1])
            elif step == "fresh":
                talk, marks = model.conversation(), []
            elif step == "answer":
                talk.append(value, role="assistant")
            elif step == "reply" and not (talk.turns and talk.turns[-1].role == "user"):
                heard.append("nothing to reply to")
            elif step == "reply":
                reply = talk.reply(up_to(value))
                heard.append((reply.text, reply.token_ids, reply.n_context_tokens))
        return heard

    assert play(tiny) == play(plain)


def test_the_second_question_pays_for_itself_only(tiny, frames):
    talk = tiny.conversation()
    talk.append(*frames)
    start = talk.mark()
    talk.append("\nWhere is it?")
    talk.reply(up_to(NEW))
    talk.rewind(start)
    talk.append("\nHow many?")
    again = talk.reply(up_to(NEW))
    assert again.n_cached_tokens > len(frames) * (9 + 2)
    assert again.n_context_tokens - again.n_cached_tokens < 20


def test_other_conversations_share_frames_too(tiny, frames):
    for expected in (False, True):
        reply = ask(tiny, *frames[::-1], "\nAgain?", new=1)
        assert (reply.n_cached_tokens > 50) is expected


def test_without_sharing_nothing_is_cached(plain, frames):
    talk = plain.conversation()
    talk.append(*frames)
    assert [talk.reply(up_to(1)).n_cached_tokens for _ in range(2)] == [0, 0]


def test_features_are_computed_once_per_frame(frames, monkeypatch):
    model = load("qwen2.5-vl-tiny", {}, seed=0)
    decoded = []
    whole = FrameRef.load

    def counting(self):
        decoded.append(self.path)
        return whole(self)

    monkeypatch.setattr(FrameRef, "load", counting)
    for order in ([0, 1, 2], [2, 1, 0], [0, 0, 1]):
        ask(model, *(frames[index] for index in order), "?", new=1)
    assert sorted(decoded) == [frames[index].path for index in range(3)]


@pytest.mark.parametrize("megabytes", ["0", "1"])
def test_any_size_of_the_feature_cache_gives_the_same_reply(plain, frames, megabytes):
    model = load("qwen2.5-vl-tiny", {"feature_cache_mb": megabytes}, seed=0)
    replies = [ask(each, *frames, "\nWhat?", new=NEW).token_ids for each in (model, plain)]
    assert replies[0] == replies[1]
    assert model._embed._features._bytes <= int(megabytes) * 2**20


def test_stop_strings_end_the_reply(tiny, frames):
    talk = talk_of(tiny, user(frames[0], "\nSay something."))
    whole = talk.reply(up_to(20))
    stop = whole.text[4:6]
    cut = talk.reply(up_to(20, stop=("never there", stop)))
    assert cut.text == whole.text[: whole.text.index(stop)]
    assert len(cut.token_ids) < len(whole.token_ids)
    assert cut.token_ids == whole.token_ids[: len(cut.token_ids)]


def test_too_long_a_context_gives_tokens_and_limit(frames):
    model = load("qwen2.5-vl-tiny", {"max_tokens": "60"}, seed=0)
    talk = model.conversation()
    talk.append(frames[0])
    talk.reply(up_to(4))
    talk.append(*frames)
    with pytest.raises(
        ModelError, match=f"context of {talk.n_tokens} tokens and 4 new ones .* 60 tokens"
    ):
        talk.reply(up_to(4))


def test_max_tokens_is_the_checkpoints_or_the_options(tiny):
    assert tiny.capabilities.max_tokens == 128_000
    assert load("qwen2.5-vl-tiny", {"max_tokens": "0"}, seed=0).capabilities.max_tokens is None


def test_a_text_with_the_image_token_is_refused(tiny, frames):
    with pytest.raises(ModelError, match="2 image placeholders for 1 frames"):
        ask(tiny, frames[0], "<|image_pad|>", new=1)


ERRORS = [
    torch.OutOfMemoryError("no memory"),
    RuntimeError("[enforce fail at alloc_cpu.cpp:1] DefaultCPUAllocator: can't allocate memory"),
]


@pytest.mark.parametrize("error", ERRORS)
def test_out_of_memory_names_the_size_and_the_model_goes_on(
    tiny, plain, frames, monkeypatch, error
):
    parts = (*frames, "\nWhat?")
    talk = talk_of(tiny, user(*parts))
    forward = tiny._loaded.model.forward
    calls = []

    def failing(*args, **kwargs):
        calls.append(1)
        output = forward(*args, **kwargs)
        if len(calls) == 2:
            raise error
        return output

    monkeypatch.setattr(tiny._loaded.model, "forward", failing)
    tiny._prefix.reset()
    with pytest.raises(ModelError, match=f"out of memory on a context of {talk.n_tokens} tokens"):
        talk.reply(up_to(NEW))
    assert tiny._embed._features._bytes == tiny._prefix.n_tokens == 0
    monkeypatch.undo()
    assert talk.reply(up_to(NEW)).token_ids == ask(plain, *parts, new=NEW).token_ids


def test_an_interrupted_reply_leaves_nothing_half_encoded(tiny, plain, frames, monkeypatch):
    parts = (*frames, "\nWhat?")
    talk = talk_of(tiny, user(*parts))
    last = tiny._loaded.model.model.language_model.layers[1]
    forward, calls = last.forward, []

    def interrupted(*args, **kwargs):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return forward(*args, **kwargs)

    tiny._prefix.reset()
    # In the second chunk, the first layer has stored its keys when the last one fails.
    monkeypatch.setattr(last, "forward", interrupted)
    with pytest.raises(KeyboardInterrupt):
        talk.reply(up_to(NEW))
    monkeypatch.undo()
    assert talk.reply(up_to(NEW)).token_ids == ask(plain, *parts, new=NEW).token_ids


@pytest.mark.parametrize("damage", ["none", "not an image", "cut off in the middle"])
def test_a_frame_that_cannot_be_read_is_a_data_error_and_the_model_goes_on(
    tiny, frames, tmp_path, damage
):
    path = tmp_path / "broken.png"
    if damage != "none":
        path.write_bytes(b"no" if "not" in damage else frames[1].path.read_bytes()[:-200])
    talk = tiny.conversation()
    talk.append(frames[0])
    start = talk.mark()
    before = talk.reply(up_to(NEW))
    talk.append(FrameRef(path))
    with pytest.raises(DataError, match=r"broken\.png"):
        talk.reply(up_to(NEW))
    talk.rewind(start)
    assert talk.reply(up_to(NEW)).token_ids == before.token_ids


def test_the_model_without_sharing_keeps_its_contract(plain):
    check_adapter(plain, frame_size=(56, 56))
