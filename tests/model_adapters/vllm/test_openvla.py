"""OpenVLA on the double: the actions of the native port."""

import json
import shutil
from pathlib import Path

import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters import check_adapter
from model_adapters.tiny.openvla import OpenVLATiny

from ..asking import load_saved, load_with


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    checkpoint = tmp_path_factory.mktemp("openvla")
    OpenVLATiny.twin.save(checkpoint, seed=0)
    return checkpoint


@pytest.fixture
def policy(vllm, folder):
    """Starts the tiny policy on the double."""

    def start(**options):
        return load_with("openvla@vllm", **{"pretrained": folder, "dtype": "float32", **options})

    return start


@pytest.mark.parametrize("constrained", [True, False])
def test_actions_are_those_of_the_native_port(constrained, policy, folder, frames):
    ours = policy(constrained=constrained)
    theirs = load_saved("openvla", folder, constrained=constrained)
    requests = [
        (frame, text) for frame in frames[:3] for text in ("pick up the Mug", "close the fridge")
    ]
    actions = [[each.act(frame, text) for frame, text in requests] for each in (ours, theirs)]
    assert actions[0] == actions[1]
    # Without, it writes words, which are clipped.
    assert len(set(actions[0])) > 1 or not constrained


def test_it_keeps_the_contract_of_policies(policy):
    acting = policy()
    check_adapter(acting)
    acting.close()


def test_what_vllm_is_asked(policy, vllm, frames, folder):
    policy(max_model_len=512, tensor_parallel_size=2).act(frames[0], "Pick up the mug")
    assert vllm.started[0]["limit_mm_per_prompt"] == {"image": 1}
    assert (vllm.started[0]["max_model_len"], vllm.started[0]["tensor_parallel_size"]) == (512, 2)
    (call,) = vllm.calls
    assert call.prompts[0]["prompt_token_ids"][-1] == 29_871
    assert (call.params.max_tokens, call.params.temperature, call.params.ignore_eos) == (7, 0, True)
    assert call.params.allowed_token_ids == list(range(31_744, 32_000))
    policy(constrained=False).act(frames[0], "Pick up the mug")
    assert vllm.calls[-1].params.allowed_token_ids is None


def test_too_few_tokens_are_told(policy, vllm, frames, monkeypatch):
    acting = policy()
    monkeypatch.setattr(
        "tests.model_adapters.vllm.double._OpenVLA.write", lambda *_: ([31_800] * 3, "")
    )
    with pytest.raises(ModelError, match=r"openvla@vllm: vLLM wrote 3 action tokens, not 7"):
        acting.act(frames[0], "pick up the mug")


def test_its_identity_has_engine_and_dataset(policy):
    identity = policy().identity()
    assert (identity["engine"], identity["unnorm_key"], identity["adapter"]) == (
        "vllm",
        "bridge_orig",
        "openvla@vllm",
    )
    assert identity != policy(enforce_eager=True).identity()


def test_what_is_wrong_with_checkpoint_or_key_is_told_as_in_the_native_port(
    policy, vllm, checkpoints
):
    with pytest.raises(UsageError, match="unnorm_key=x is not a dataset"):
        policy(unnorm_key="x")
    with pytest.raises(ModelError, match="is a qwen2_5_vl checkpoint, not openvla"):
        policy(pretrained=checkpoints["qwen2.5-vl"])
    assert vllm.started == []


@pytest.mark.parametrize("content", [None, {}, {"bos_token": None}])
def test_a_tokenizer_without_a_begin_token_is_refused(content, policy, folder, vllm, tmp_path):
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    (copy / "tokenizer_config.json").unlink()
    if content is not None:
        (copy / "tokenizer_config.json").write_text(json.dumps(content))
    with pytest.raises(
        ModelError,
        match=r"tokenizer_config\.json of .* names no bos_token, .* --engine transformers",
    ):
        policy(pretrained=copy)
    assert vllm.started == []
