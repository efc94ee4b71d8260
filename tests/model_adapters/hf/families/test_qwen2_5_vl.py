"""The Qwen2.5-VL family: loading real checkpoint folders, and the tiny twin."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from functools import partial

import pytest
import torch
from safetensors.torch import load_file, save_file

from infthor_eval.errors import ModelError, UsageError
from model_adapters import load
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

from ....helpers.refusals import assert_raises_one_line, read_one_line
from ...asking import ask, load_saved, talk_of, user


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoints") / "tiny"
    save_tiny_checkpoint(folder, seed=0)
    return folder


@pytest.fixture
def copy(checkpoint, tmp_path):
    return shutil.copytree(checkpoint, tmp_path / "tiny")


_load = partial(load_saved, "qwen2.5-vl")


def _ask(model, *parts):
    return ask(model, *parts, "\nWhat do you see?", new=8)


def test_replies_differ_between_frames_and_between_questions(tiny, frames):
    assert len({_ask(tiny, frame).text for frame in frames}) > 3
    things = ("mug", "pan", "bed")
    assert len({_ask(tiny, frames[0], f"\nIs the {thing} here?").text for thing in things}) > 1


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
    assert _ask(one, *frames).token_ids != _ask(other, *frames).token_ids


def test_identity_has_what_can_change_a_number(checkpoint):
    identity = _load(checkpoint, attn_implementation="eager").identity()
    assert identity["checkpoint"] == "tiny"
    assert len(identity["fingerprint"]) == 32
    assert identity["n_parameters"] == sum(
        tensor.numel() for tensor in load_file(checkpoint / "model.safetensors").values()
    )
    asked = {"dtype": "float32", "device": "cpu", "attn_implementation": "eager"}
    assert identity.items() >= (asked | {"share_prefix": True}).items()
    assert identity["versions"]["torch"] == torch.__version__
    assert _load(checkpoint, dtype="bfloat16").identity()["dtype"] == "bfloat16"


def test_identity_follows_the_content_not_the_place(checkpoint, copy):
    assert _load(copy).identity() == _load(checkpoint).identity()
    (copy / "generation_config.json").write_text('{"eos_token_id": [1]}')
    assert _load(copy).identity() != _load(checkpoint).identity()


def test_max_pixels_makes_frames_cheaper(checkpoint, make_frames):
    frame = make_frames(1, 300, 300)[0]
    large, small = (
        talk_of(_load(checkpoint, **options), user(frame)).n_tokens
        for options in ({}, {"max_pixels": 120 * 120})
    )
    assert large - small == 121 - 16


@pytest.mark.parametrize("attention", ["eager", "sdpa"])
def test_attention_implementations_agree(checkpoint, tiny, frames, attention):
    model = _load(checkpoint, attn_implementation=attention, chunk_tokens="20")
    assert _ask(model, *frames).token_ids == _ask(tiny, *frames).token_ids


def test_without_network_the_mend_is_named(monkeypatch):
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", True)
    assert_raises_one_line(
        lambda: load("qwen2.5-vl", {"pretrained": "nobody/nothing"}, seed=0),
        "hf download nobody/nothing --local-dir DIR",
    )


def test_a_checkpoint_of_another_model_type_is_refused(copy):
    (copy / "config.json").write_text('{"model_type": "llama"}')
    with pytest.raises(ModelError, match="is a llama checkpoint, not qwen2_5_vl"):
        _load(copy)


@pytest.mark.parametrize("name", ["config.json", "model.safetensors", "preprocessor_config.json"])
def test_an_incomplete_or_damaged_checkpoint_is_one_line(copy, name):
    if name == "model.safetensors":
        (copy / name).write_bytes(b"\x10\0\0\0\0\0\0\0 broken")
        assert_raises_one_line(lambda: _load(copy), "cannot be loaded")
    (copy / name).unlink()
    assert_raises_one_line(lambda: _load(copy), "cannot be loaded")
    shutil.rmtree(copy)
    assert_raises_one_line(lambda: _load(copy), "no such folder")


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
    assert _ask(model, *frames).token_ids == _ask(tiny, *frames).token_ids
    assert model.identity() == _load(checkpoint).identity()


@pytest.mark.parametrize("value", ["bnb4", "bnb8"])
def test_quantisation_without_its_library_is_one_line(checkpoint, value):
    if importlib.util.find_spec("bitsandbytes") is not None:
        pytest.skip("bitsandbytes is installed")
    with pytest.raises(
        ModelError, match=r"cannot be loaded \(.*(bitsandbytes|accelerate)"
    ) as caught:
        _load(checkpoint, quantization=value)
    read_one_line(caught)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("quantization", "q5", ": give bnb4 or bnb8"),
        ("dtype", "float33", ""),
        ("device", "abacus", ""),
    ],
)
def test_an_unknown_quantisation_dtype_or_device_is_a_usage_error(
    checkpoint, option, value, message
):
    with pytest.raises(UsageError, match=f"{option}={value}{message}"):
        _load(checkpoint, **{option: value})
