"""hf-vlm on checkpoints that transformers' own `save_pretrained` wrote, of families this project
has no code for."""

import json
import shutil
from dataclasses import replace
from functools import partial

import pytest
import torch
from transformers import LlamaConfig, Qwen2VLConfig

from infthor_eval.errors import ModelError, UsageError
from model_adapters import check_adapter, load
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.prompting.prompt import token_ids
from model_adapters.hf.uncached import UncachedModel, process_turns
from model_adapters.tiny.pixtral import PixtralTiny
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny, save_tiny_checkpoint
from model_adapters.tiny.twin import HIDDEN

from ...asking import ask, load_saved, talk_of, up_to, user

_load = partial(load_saved, "hf-vlm")


@pytest.mark.parametrize("name", ["llava", "idefics3", "deepseek-vl-1.3b", "nemotron-h-omni"])
def test_an_unknown_family_shares_prefixes_and_replies_as_generate(name, checkpoints, frames):
    shared, whole = _both(checkpoints[name], frames)
    check_adapter(shared)
    check_adapter(whole)


def test_frames_are_split_as_the_option_says(checkpoints, frames):
    by_default = _load(checkpoints["idefics3"])
    counts = {}
    for splitting in (True, False):
        model = _load(checkpoints["idefics3"], image_splitting=splitting)
        assert model.identity()["image_processor"]["do_image_splitting"] is splitting
        counts[splitting] = model.tokens_per_frame(frames[0])
    assert by_default.tokens_per_frame(frames[0]) == counts[True] > counts[False]
    with pytest.raises(ModelError, match="cannot split frames; leave image_splitting out"):
        _load(checkpoints["llava"], image_splitting="true")


def test_an_image_seen_in_both_directions_shares_prefixes(checkpoints, frames):
    shared, whole = _both(checkpoints["gemma3"], frames, chunk_tokens=40)
    # The same behind two frames and behind one: the latter leaves frames to the continuations.
    for n_shared in (2, 1):
        turns = [
            user(*frames[:n_shared], frame, "\nWhat is it?", word)
            for frame, word in ((frames[2], "mug"), (frames[3], "egg"), (frames[2], "cup"))
        ]
        together, alone = shared.answer_each(turns, up_to(6)), whole.answer_each(turns, up_to(6))
        assert [one.token_ids for one in together] == [one.token_ids for one in alone]


def _both(folder, frames, **options):
    """The model with shared prefixes and without, once their replies behind a prefix are equal."""
    shared, whole = _load(folder, **options), _load(folder, share_prefix=False)
    assert isinstance(shared, TransformersModel)
    assert isinstance(whole, UncachedModel)
    replies = []
    for model in (shared, whole):
        talk = model.conversation()
        talk.append("Look:\n", *frames[:3], "\n\nmug")
        start, heard = talk.mark(), []
        for question in ("\nWhat is it?", frames[4]):
            talk.append(question)
            heard.append((talk.n_tokens, talk.reply(up_to(6)).token_ids))
            talk.rewind(start)
        replies.append(heard)
    assert replies[0] == replies[1]
    assert shared.tokens_per_frame(frames[0]) == whole.tokens_per_frame(frames[0])
    return shared, whole


def test_any_architecture_runs_without_sharing(checkpoints, frames):
    model = _load(checkpoints["gemma3"], share_prefix="false", margins="true")
    talk = talk_of(model, user(frames[0], "\nWhat is it?"))
    inputs = process_turns(model._processor, model._loaded.template, talk.turns)
    output = model._loaded.model.generate(
        **inputs,
        do_sample=False,
        max_new_tokens=6,
        output_scores=True,
        return_dict_in_generate=True,
    )
    expected = [
        token
        for token in output.sequences[0, talk.n_tokens :].tolist()
        if token not in model._loaded.generation.end_ids
    ]
    reply = talk.reply(up_to(6))
    assert list(reply.token_ids) == expected
    best = [scores[0].topk(2).values.tolist() for scores in output.scores]
    assert reply.margins == pytest.approx([first - second for first, second in best], abs=1e-4)
    assert reply.n_cached_tokens == 0
    assert model.identity()["share_prefix"] is False


def test_the_end_token_is_no_part_of_a_reply_without_sharing(checkpoints, tmp_path, frames):
    parts = (*frames[:2], "\nWhat is it?")
    whole = ask(_load(checkpoints["llava"], share_prefix=False), *parts, new=6).token_ids
    folder = shutil.copytree(checkpoints["llava"], tmp_path / "llava")
    (folder / "generation_config.json").write_text(json.dumps({"eos_token_id": whole[3]}))
    ended = ask(_load(folder, share_prefix=False), *parts, new=6)
    assert ended.token_ids == whole[: whole.index(whole[3])]


def test_samples_may_be_longer_than_the_context_limit(checkpoints):
    for options in ({}, {"share_prefix": "false"}):
        assert _load(checkpoints["llava"], max_tokens="20", **options).capabilities.max_tokens == 20


def test_known_families_need_no_processor(tmp_path, frames):
    save_tiny_checkpoint(tmp_path / "qwen", seed=0)
    PixtralTiny.twin.save(tmp_path / "pixtral", seed=0)
    for folder in ("qwen", "pixtral"):
        (tmp_path / folder / "processor_config.json").unlink()
        model = _load(tmp_path / folder)
        assert isinstance(model, TransformersModel)
        talk = talk_of(model, user(*frames[:2], "?"))
        assert talk.reply(up_to(2)).n_context_tokens == talk.n_tokens


def _qwen2_vl_config(ids, vocab_size):
    newer = Qwen25VLTiny.twin.config(ids, vocab_size)
    text = newer.text_config.to_dict()
    del text["model_type"]
    names = ("image_token_id", "video_token_id", "vision_start_token_id", "vision_end_token_id")
    sizes = {"depth": 2, "embed_dim": 32, "hidden_size": HIDDEN, "num_heads": 2, "mlp_ratio": 2}
    return Qwen2VLConfig(
        text_config=text,
        vision_config=sizes,
        **{name: getattr(newer, name) for name in names},
    )


def test_qwen2_vl_runs_as_its_successor_and_as_transformers_has_it(tmp_path, frames):
    replace(Qwen25VLTiny.twin, config=_qwen2_vl_config).save(tmp_path, seed=0)
    model = _load(tmp_path, chunk_tokens="30")
    parts = ("Goal.", *frames[:3], "\nWhat is it?")
    pieces = model.pieces(user(*parts))
    ids = torch.tensor([list(token_ids(pieces))])
    pixels = model._loaded.family._image_processor(
        images=[ref.load() for ref in frames[:3]], return_tensors="pt"
    )
    bare = model._loaded.model
    with torch.inference_mode():
        plain = bare(
            input_ids=ids, mm_token_type_ids=(ids == bare.config.image_token_id).int(), **pixels
        )
    torch.testing.assert_close(model.encode(pieces), plain.logits[0, -1], atol=1e-4, rtol=1e-4)
    assert type(bare).__name__ == "Qwen2VLForConditionalGeneration"


def test_no_checkpoint_is_a_usage_error():
    with pytest.raises(UsageError, match=r"hf-vlm needs pretrained=\.\.\."):
        load("hf-vlm", {}, seed=0)


def test_a_model_without_images_is_refused(tmp_path):
    LlamaConfig(vocab_size=10).save_pretrained(tmp_path)
    with pytest.raises(ModelError, match="is a llama checkpoint, which has no vision"):
        _load(tmp_path)


@pytest.mark.parametrize(
    ("name", "piece", "other", "complaint"),
    [
        (
            "processor_config.json",
            '"patch_size": 14',
            '"patch_size": 28',
            r"do not match, .* do they belong to one checkpoint\?$",
        ),
        ("chat_template.jinja", "<image>", "", "0 image placeholders for 3 frames"),
        ("chat_template.jinja", "part.text", "''", "drops the text 'The first view:'"),
    ],
)
def test_a_processor_or_template_of_another_model_is_refused(
    checkpoints, tmp_path, name, piece, other, complaint
):
    folder = shutil.copytree(checkpoints["llava"], tmp_path / "llava")
    written = (folder / name).read_text()
    assert piece in written
    (folder / name).write_text(written.replace(piece, other))
    with pytest.raises(ModelError, match=complaint):
        _load(folder)


@pytest.mark.parametrize("name", ["llava", "gemma3"])
def test_what_is_read_has_the_same_hashes_with_and_without_sharing(name, checkpoints, frames):
    replies = []
    for options in ({"share_prefix": "true", "margins": "true"}, {"share_prefix": "false"}):
        talk = _load(checkpoints[name], **options).conversation()
        talk.append(frames[0], " and ", frames[1], "\nWhat is it?")
        replies.append(talk.reply(up_to(3)))
        talk.append(frames[2])
        replies.append(talk.reply(up_to(3)))
    shared, more, whole, _ = replies
    assert (shared.context_hash, shared.frames_hash) == (whole.context_hash, whole.frames_hash)
    assert shared.frames_hash != more.frames_hash
    assert shared.frames_hash is not None
    assert len(shared.margins) >= len(shared.token_ids)
    assert whole.margins is None
