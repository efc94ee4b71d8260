"""The Qwen2.5-VL family: loading real checkpoint folders, and the tiny twin."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from infthor_eval.errors import ModelError, UsageError
from model_adapters import check_adapter, load
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

from ...asking import up_to


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoints") / "tiny"
    save_tiny_checkpoint(folder, seed=0)
    return folder


@pytest.fixture
def copy(checkpoint, tmp_path):
    return shutil.copytree(checkpoint, tmp_path / "tiny")


def _load(folder, **options):
    return load("qwen2.5-vl", {"pretrained": str(folder), "device": "cpu", **options}, seed=0)


def _ask(model, frames, text="\nWhat do you see?"):
    talk = model.conversation()
    talk.append(*frames, text)
    return talk.reply(up_to(8))


def test_a_published_frame_takes_121_tokens_and_two_markers(tiny, make_frames):
    first, second = make_frames(2, 300, 300)
    talk = tiny.conversation()
    talk.append(first)
    before = talk.n_tokens
    talk.append(second)
    assert talk.n_tokens - before == 121 + 2


def test_replies_differ_between_frames_and_between_questions(tiny, frames):
    assert len({_ask(tiny, [frame]).text for frame in frames}) > 3
    assert (
        len(
            {
                _ask(tiny, frames[:1], f"\nIs the {thing} here?").text
                for thing in ("mug", "pan", "bed")
            }
        )
        > 1
    )


def test_weights_and_tokenizer_are_the_same_for_a_seed_in_every_process(checkpoint, tmp_path):
    code = (
        "import pathlib, sys; from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint;"
        "save_tiny_checkpoint(pathlib.Path(sys.argv[1]), 0)"
    )
    again = tmp_path / "again"
    environment = os.environ | {"PYTHONHASHSEED": "1"}
    subprocess.run(
        [sys.executable, "-c", code, str(again)], check=True, env=environment, capture_output=True
    )
    for name in ("model.safetensors", "tokenizer.json"):
        assert (again / name).read_bytes() == (checkpoint / name).read_bytes()


def test_seeds_give_different_models_and_leave_torchs_own_alone(frames):
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    one, other = (load("qwen2.5-vl-tiny", {}, seed=seed) for seed in (1, 2))
    assert torch.equal(torch.rand(1), expected)
    assert one.identity() != other.identity()
    assert _ask(one, frames).token_ids != _ask(other, frames).token_ids


def test_a_saved_checkpoint_answers_as_the_tiny_model(checkpoint, tiny, frames):
    loaded = _load(checkpoint)
    assert _ask(loaded, frames).token_ids == _ask(tiny, frames).token_ids
    check_adapter(loaded, frame_size=(56, 56))


def test_identity_has_what_can_change_a_number(checkpoint):
    identity = _load(checkpoint, attn_implementation="eager").identity()
    assert identity["checkpoint"] == "tiny"
    assert len(identity["fingerprint"]) == 32
    assert identity["n_parameters"] == sum(
        tensor.numel() for tensor in load_file(checkpoint / "model.safetensors").values()
    )
    assert identity["dtype"] == "float32"
    assert identity["device"] == "cpu"
    assert identity["attn_implementation"] == "eager"
    assert identity["versions"]["torch"] == torch.__version__
    assert identity["share_prefix"] is True


def test_identity_follows_the_content_not_the_place(checkpoint, copy):
    assert _load(copy).identity() == _load(checkpoint).identity()
    (copy / "generation_config.json").write_text('{"eos_token_id": [1]}')
    assert _load(copy).identity() != _load(checkpoint).identity()


def test_max_pixels_makes_frames_cheaper(checkpoint, make_frames):
    frame = make_frames(1, 300, 300)[0]
    sizes = []
    for options in ({}, {"max_pixels": str(120 * 120)}):
        talk = _load(checkpoint, **options).conversation()
        talk.append(frame)
        sizes.append(talk.n_tokens)
    assert sizes[0] - sizes[1] == 121 - 16


def test_dtype_and_device_are_taken(checkpoint, frames):
    model = _load(checkpoint, dtype="bfloat16")
    assert model.identity()["dtype"] == "bfloat16"
    assert _ask(model, frames).n_context_tokens > 0


@pytest.mark.parametrize("attention", ["eager", "sdpa"])
def test_attention_implementations_agree(checkpoint, tiny, frames, attention):
    model = _load(checkpoint, attn_implementation=attention, chunk_tokens="20")
    assert _ask(model, frames).token_ids == _ask(tiny, frames).token_ids


def _one_line(error):
    assert "\n" not in str(error)
    return str(error)


def test_a_missing_folder_is_one_line():
    with pytest.raises(ModelError, match="no such folder") as caught:
        _load(Path("/nowhere/at/all"))
    _one_line(caught.value)


def test_without_network_the_mend_is_named(monkeypatch):
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", True)
    with pytest.raises(ModelError, match="hf download nobody/nothing --local-dir DIR") as caught:
        load("qwen2.5-vl", {"pretrained": "nobody/nothing"}, seed=0)
    _one_line(caught.value)


def test_a_checkpoint_of_another_model_type_is_refused(copy):
    (copy / "config.json").write_text('{"model_type": "llama"}')
    with pytest.raises(ModelError, match="is a llama checkpoint, not qwen2_5_vl"):
        _load(copy)


@pytest.mark.parametrize("name", ["config.json", "model.safetensors", "preprocessor_config.json"])
def test_an_incomplete_checkpoint_is_one_line(copy, name):
    (copy / name).unlink()
    with pytest.raises(ModelError, match="cannot be loaded") as caught:
        _load(copy)
    _one_line(caught.value)


def test_a_damaged_weights_file_is_one_line(copy):
    (copy / "model.safetensors").write_bytes(b"\x10\0\0\0\0\0\0\0 broken")
    with pytest.raises(ModelError, match="cannot be loaded") as caught:
        _load(copy)
    _one_line(caught.value)


def test_weights_that_are_missing_are_not_left_random(copy):
    weights = load_file(copy / "model.safetensors")
    del weights["lm_head.weight"]
    save_file(weights, copy / "model.safetensors", metadata={"format": "pt"})
    with pytest.raises(ModelError, match=r"lacks 1 weights of its model \(lm_head.weight"):
        _load(copy)


def test_the_template_may_lie_in_the_old_json_file_or_the_tokenizer(copy, tiny):
    template = (copy / "chat_template.jinja").read_text()
    (copy / "chat_template.jinja").unlink()
    with pytest.raises(ModelError, match="no chat template"):
        _load(copy)
    (copy / "chat_template.json").write_text(json.dumps({"chat_template": template}))
    assert _load(copy).identity()["chat_template"] == tiny.identity()["chat_template"]


def test_keys_and_values_can_lie_in_cpu_memory(checkpoint, tiny, frames):
    model = _load(checkpoint, kv_offload="true")
    assert _ask(model, frames).token_ids == _ask(tiny, frames).token_ids
    assert model.identity() == _load(checkpoint).identity()


@pytest.mark.parametrize("value", ["bnb4", "bnb8"])
def test_quantisation_without_its_library_is_one_line(checkpoint, value):
    if importlib.util.find_spec("bitsandbytes") is not None:
        pytest.skip("bitsandbytes is installed")
    with pytest.raises(
        ModelError, match=r"cannot be loaded \(.*(bitsandbytes|accelerate)"
    ) as caught:
        _load(checkpoint, quantization=value)
    _one_line(caught.value)


def test_an_unknown_quantisation_is_a_usage_error(checkpoint):
    with pytest.raises(UsageError, match="quantization=q5 is not bnb4, bnb8 or none"):
        _load(checkpoint, quantization="q5")


@pytest.mark.parametrize(("option", "value"), [("dtype", "float33"), ("device", "abacus")])
def test_an_unknown_dtype_or_device_is_a_usage_error(checkpoint, option, value):
    with pytest.raises(UsageError, match=f"{option}={value}"):
        _load(checkpoint, **{option: value})
