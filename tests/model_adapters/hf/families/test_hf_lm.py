"""hf-lm on tiny language models."""

import json
import shutil
from functools import partial

import pytest
import torch
from transformers import AutoModelForCausalLM, AutoTokenizer, CLIPConfig

from infthor_eval.errors import ModelError, UsageError
from model_adapters import Video, check_adapter, load
from model_adapters.hf.prompting.prompt import token_ids

from ....helpers.refusals import read_one_line
from ...asking import ask, load_saved, talk_of, up_to, user
from ...language_models import SETTINGS, TEMPLATE, save_language_model

LOG = "PickupObject Mug. MoveAhead. OpenObject Fridge. " * 6
QUESTIONS = ("\nWhere is the mug?", "\nWhat did you open?")

_load = partial(load_saved, "hf-lm")


def _generate(folder, text, new):
    """Ids of the prompt, and those that transformers' own `generate` adds to them."""
    tokenizer = AutoTokenizer.from_pretrained(folder)
    kernel = "eager" if folder.name == "gemma2" else "sdpa"
    model = AutoModelForCausalLM.from_pretrained(folder, attn_implementation=kernel)
    written = tokenizer.apply_chat_template(
        [{"role": "user", "content": text}], tokenize=False, add_generation_prompt=True
    )
    ids = tokenizer(written)["input_ids"]
    output = model.generate(torch.tensor([ids]), do_sample=False, max_new_tokens=new)
    reply = [
        token for token in output[0, len(ids) :].tolist() if token != model.config.eos_token_id
    ]
    return ids, tuple(reply)


@pytest.mark.parametrize("model_type", SETTINGS)
def test_replies_are_those_of_generate_and_share_a_prefix(model_type, language_models):
    model = _load(language_models / model_type, chunk_tokens=40)
    talk = talk_of(model, user(LOG))
    alone = []
    for question in QUESTIONS:
        start = talk.mark()
        talk.append(question)
        ids, expected = _generate(language_models / model_type, LOG + question, 8)
        assert list(token_ids(model.pieces(talk.turns))) == ids
        reply = talk.reply(up_to(8))
        assert reply.token_ids == expected
        alone.append(reply)
        talk.rewind(start)
    n_before = len(ids) - len(model.pieces(user(QUESTIONS[1])))
    linear = model_type in (
        "nemotron_h",
        "qwen3_5_text",
    )  # its states cannot be cut behind any token
    assert alone[0].n_cached_tokens == 0
    assert alone[1].n_cached_tokens == 0 if linear else alone[1].n_cached_tokens >= n_before
    together = talk.replies([[question] for question in QUESTIONS], up_to(8))
    assert [one.token_ids for one in together] == [one.token_ids for one in alone]
    assert model.capabilities.max_tokens == 2048
    # torch's kernel would not cap the scores of Gemma 2.
    kernel = "eager" if model_type == "gemma2" else "sdpa"
    assert model.identity()["attn_implementation"] == kernel


@pytest.mark.parametrize("model_type", ["llama", "qwen2"])
def test_a_model_without_vision_keeps_the_contract(model_type, language_models):
    model = _load(language_models / model_type)
    assert model.capabilities.batch_size > 1
    assert not model.capabilities.image_input
    check_adapter(model)
    assert "image_processor" not in model.identity()
    assert model.identity()["class"].endswith("ForCausalLM")


def test_texts_with_nothing_in_common_are_answered_together(language_models):
    model = _load(language_models / "llama", prompt="plain")
    talk = model.conversation()
    asked = [["RotateLeft then?"], ["What is it?"]]
    together = talk.replies(asked, up_to(4))
    assert [one.token_ids for one in together] == [ask(model, *it).token_ids for it in asked]


def test_turns_of_every_role_are_read(language_models):
    model = _load(language_models / "llama")
    talk = model.conversation()
    for role, text in (
        ("system", "Be brief."),
        ("user", "A?"),
        ("assistant", "B."),
        ("user", "C?"),
    ):
        talk.append(text, role=role)
    written = model._loaded.tokenizer.decode(list(token_ids(model.pieces(talk.turns))))
    turns = ("Be brief.", "A?", "B.", "C?")
    said = "".join(f"<|im_start|>{text}<|im_end|>" for text in turns)
    assert written == f"<s>{said}<|im_start|>"


def test_a_reply_that_begins_in_thought_is_known(language_models, tmp_path):
    folder = shutil.copytree(language_models / "llama", tmp_path / "thinker")
    template = TEMPLATE.replace("'<|im_start|>' }}{% endif", "'<|im_start|><think>\\n' }}{% endif")
    (folder / "chat_template.jinja").write_text(template)
    assert _load(folder)._loaded.opening == "<think>"


def test_frames_are_refused_before_anything_is_computed(language_models, frames, monkeypatch):
    model = _load(language_models / "llama")
    monkeypatch.setattr(model, "pieces", None)
    for shown in (frames[0], Video((frames[0],), 1.0)):
        talk = talk_of(model, user("Look: ", shown, "?"))
        for ask_for in (partial(talk.reply, up_to(2)), partial(getattr, talk, "n_tokens")):
            with pytest.raises(
                ModelError, match="hf-lm reads text alone, and this context"
            ) as raised:
                ask_for()
            read_one_line(raised)
    with pytest.raises(ModelError, match="reads text alone"):
        model.tokens_per_frame(frames[0])


def test_prompts_beyond_the_limit_are_refused(language_models):
    model = _load(language_models / "llama")
    with pytest.raises(ModelError, match="beyond the 2048 tokens of hf-lm"):
        ask(model, LOG * 40)


def test_what_is_no_language_model_is_refused(tmp_path):
    CLIPConfig().save_pretrained(tmp_path)
    with pytest.raises(ModelError, match="is a clip checkpoint, which is no language") as raised:
        _load(tmp_path)
    read_one_line(raised)


def test_a_checkpoint_with_vision_is_refused(checkpoints):
    with pytest.raises(
        ModelError, match="is a llava checkpoint, which has vision; use hf-vlm"
    ) as raised:
        _load(checkpoints["llava"])
    read_one_line(raised)


def test_a_model_that_sees_later_tokens_is_refused(tmp_path):
    save_language_model(tmp_path, "bert")
    with pytest.raises(ModelError, match="bert") as raised:
        _load(tmp_path)
    read_one_line(raised)


def test_no_checkpoint_is_a_usage_error():
    with pytest.raises(UsageError, match=r"hf-lm needs pretrained=\.\.\."):
        load("hf-lm", {}, seed=0)


def test_a_model_without_a_chat_template_is_read_plainly(language_models, tmp_path):
    folder = shutil.copytree(language_models / "gpt_neox", tmp_path / "base")
    (folder / "chat_template.jinja").unlink()
    assert "chat_template" not in json.loads((folder / "tokenizer_config.json").read_text())
    with pytest.raises(ModelError, match="has no chat template; add"):
        _load(folder)
    model = _load(folder, prompt="plain")
    ids = list(token_ids(model.pieces(user("RotateLeft"))))
    assert ids == model._loaded.tokenizer("RotateLeft")["input_ids"]
