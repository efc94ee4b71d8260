"""What becomes of each option, by hand, and that vLLM takes it."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from transformers import Llama4Config, LlamaConfig, Qwen2_5_VLConfig

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.plugins import import_target
from model_adapters import check_options, options_of
from model_adapters.hf.loading.rope import apply_rope
from model_adapters.vllm.adapter import Qwen25VLOnVllm
from model_adapters.vllm.arguments import (
    engine_arguments,
    frame_limit,
    model_arguments,
    rope_overrides,
    token_limit,
)
from model_adapters.vllm.options import EngineOptions, VllmOptions
from model_adapters.vllm.plugin import encoder_cache_of

from .double import SIGNATURES

TAKEN = {*SIGNATURES["LLM"], *SIGNATURES["EngineArgs"]}
FOLDER = Path("checkpoint")


def _qwen(rope):
    config = Qwen2_5_VLConfig(
        text_config={
            "max_position_embeddings": 128_000,
            "rope_parameters": {
                "rope_type": "default",
                "rope_theta": 1e6,
                "mrope_section": [16, 24, 24],
            },
        }
    )
    apply_rope(config, rope)
    return config


def test_without_options_vllm_gets_what_it_needs_and_the_rest_is_its_own_choice():
    assert engine_arguments(FOLDER, EngineOptions()) == {
        "model": "checkpoint",
        "dtype": "auto",
        "seed": 0,
        "tensor_parallel_size": 1,
        "pipeline_parallel_size": 1,
        "data_parallel_size": 1,
        "gpu_memory_utilization": 0.9,
        "enforce_eager": False,
        "enable_prefix_caching": True,
    }


def test_llama_4_has_the_temperature_of_its_config_in_every_length():
    config = Llama4Config(text_config={"attn_temperature_tuning": True})
    arguments = model_arguments(
        FOLDER, config, VllmOptions(pretrained="x"), max_tokens=9, max_frames=1
    )
    assert arguments["override_generation_config"] == {"attn_temperature_tuning": True}


def test_every_option_arrives_under_vllms_name():
    own_names = {
        "dtype": "bfloat16",
        "trust_remote_code": True,
        "max_model_len": 9_999,
        "tensor_parallel_size": 2,
        "pipeline_parallel_size": 3,
        "data_parallel_size": 4,
        "distributed_executor_backend": "external_launcher",
        "gpu_memory_utilization": 0.5,
        "enforce_eager": True,
        "quantization": "fp8",
        "mm_processor_cache_gb": 0.0,
        "max_num_seqs": 3,
        "max_num_batched_tokens": 4_096,
        "enable_chunked_prefill": False,
        "block_size": 32,
        "kv_cache_dtype": "fp8",
        "kv_offloading_size": 1.5,
        "decode_context_parallel_size": 2,
        "prefill_context_parallel_size": 4,
        "mm_encoder_tp_mode": "data",
        "mm_encoder_attn_backend": "TORCH_SDPA",
        "seed": 7,
    }
    others = {"prefix_caching": False, "encoder_cache_tokens": 50_000, "frame_size": 640}
    typed = VllmOptions(pretrained="x", rope="yarn:4", **own_names, **others)
    arguments = model_arguments(FOLDER, _qwen("yarn:4"), typed, max_tokens=9_999, max_frames=12)
    assert arguments == own_names | {
        "model": "checkpoint",
        "enable_prefix_caching": False,
        "limit_mm_per_prompt": {"image": {"count": 12, "width": 640, "height": 640}, "video": 0},
        "mm_processor_kwargs": {"use_fast": False},
        "ec_manager_config": {
            "encoder_cache_manager_cls": "model_adapters.vllm.plugin.EncoderCacheMaker",
            "manager_config": {"tokens": 50_000},
        },
        "hf_overrides": {
            "text_config": {
                "rope_parameters": {
                    "rope_type": "yarn",
                    "rope_theta": 1e6,
                    "factor": 4.0,
                    # vLLM makes four times as many of it
                    "original_max_position_embeddings": 32_000,
                    "mrope_section": [16, 24, 24],
                },
                "max_position_embeddings": 512_000,
            }
        },
    }


@pytest.mark.parametrize(("own", "size"), [(16_384, 50_000), (60_000, 60_000)])
def test_vllm_makes_its_cache_of_encoded_frames_through_the_class_that_it_is_told(
    own, size, vllm, monkeypatch
):
    module = ModuleType("vllm.v1.core.encoder_cache_manager")
    vars(module)["EncoderCacheManager"] = SimpleNamespace
    monkeypatch.setitem(sys.modules, module.__name__, module)
    told = encoder_cache_of(50_000)
    maker = import_target(told["encoder_cache_manager_cls"].replace("plugin.", "plugin:"))
    config = SimpleNamespace(ec_manager_config=SimpleNamespace(**told))
    assert maker.create_manager(cache_size=own, vllm_config=config).cache_size == size


def test_an_older_vllm_has_no_size_for_it(start, vllm, monkeypatch):
    model = start(encoder_cache_tokens=50_000)
    assert model.identity()["throughput"] == {"encoder_cache_tokens": 50_000}
    monkeypatch.setattr(sys.modules["vllm"], "__version__", "0.32.0")
    with pytest.raises(ModelError, match=r"_tokens needs vLLM 0.33 or newer, and 0.32"):
        start(encoder_cache_tokens=50_000)


def test_limits_of_a_frames_area_are_the_processors():
    typed = Qwen25VLOnVllm.Options(
        pretrained="x", min_pixels=100, max_pixels=200, image_backend="torchvision"
    )
    arguments = model_arguments(FOLDER, _qwen("yarn:2"), typed, max_tokens=10, max_frames=1)
    assert arguments["mm_processor_kwargs"] == {
        "use_fast": True,
        "min_pixels": 100,
        "max_pixels": 200,
    }
    assert "hf_overrides" not in arguments


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "max_model_len": st.none() | st.integers(1, 2**20),
            "tensor_parallel_size": st.integers(1, 16),
            "distributed_executor_backend": st.sampled_from([None, "mp", "ray"]),
            "gpu_memory_utilization": st.floats(0.01, 1),
            "quantization": st.sampled_from([None, "fp8", "awq"]),
            "mm_processor_cache_gb": st.none() | st.floats(0, 64),
            "prefix_caching": st.booleans(),
            "image": st.none() | st.integers(1, 5_000),
        },
    )
)
def test_whatever_is_chosen_vllm_takes_all_of_it_and_no_none(chosen):
    typed = VllmOptions(pretrained="x", max_frames=chosen.pop("image", None), **chosen)
    config = LlamaConfig()
    arguments = model_arguments(
        FOLDER, config, typed, max_tokens=100, max_frames=frame_limit(100, 7, typed)
    )
    assert set(arguments) <= TAKEN
    assert None not in arguments.values()
    assert arguments["limit_mm_per_prompt"]["image"]["count"] == (typed.max_frames or 14)


def test_a_frame_is_taken_even_where_none_would_fit():
    assert frame_limit(100, 121, VllmOptions(pretrained="x")) == 1


@pytest.mark.parametrize(
    ("typed", "own", "limit"), [(None, 128_000, 128_000), (4_096, 128_000, 4_096), (9, None, 9)]
)
def test_the_limit_is_what_was_asked_for_or_the_checkpoints(typed, own, limit):
    assert token_limit("x", own, VllmOptions(pretrained="x", max_model_len=typed)) == limit


def test_a_checkpoint_without_a_limit_needs_one():
    with pytest.raises(
        ModelError, match="the config of x has no context limit; give max_model_len="
    ):
        token_limit("x", None, VllmOptions(pretrained="x"))


@pytest.mark.parametrize(
    ("rope_type", "longer"), [("yarn", True), ("longrope-scaled", True), ("linear", False)]
)
def test_a_model_of_one_part_has_its_extension_at_the_top(rope_type, longer):
    config = LlamaConfig(max_position_embeddings=100, hidden_size=64, num_attention_heads=4)
    apply_rope(config, f"{rope_type}:2")
    overrides = rope_overrides(config, f"{rope_type}:2")
    assert overrides["rope_parameters"]["rope_type"] == rope_type.partition("-")[0]
    assert overrides["rope_parameters"]["factor"] == 2
    assert overrides.get("max_position_embeddings") == (200 if longer else None)


@pytest.mark.parametrize(("rope", "scale"), [("longrope:2", 1.0), ("longrope-scaled:2", None)])
def test_the_published_longrope_tells_vllm_that_attention_is_not_scaled(rope, scale):
    config = LlamaConfig(max_position_embeddings=100, hidden_size=64, num_attention_heads=4)
    apply_rope(config, rope)
    overrides = rope_overrides(config, rope)
    assert [
        overrides["rope_parameters"].get(f"{length}_mscale") for length in ("short", "long")
    ] == [scale, scale]
    assert overrides["max_position_embeddings"] == 200


@pytest.mark.parametrize("rope", ["linear:2", "longrope:2", "longrope-scaled:2"])
def test_an_extension_that_would_lose_the_three_axes_is_refused(rope):
    with pytest.raises(
        ModelError, match=r"qwen2_5_vl, which has three-axis positions, .* only yarn; use yarn:2"
    ):
        rope_overrides(_qwen(rope), rope)


def test_a_dynamic_extension_is_refused_as_vllm_answers_nonsense_with_it():
    config = LlamaConfig(max_position_embeddings=100, hidden_size=64, num_attention_heads=4)
    apply_rope(config, "dynamic:2")
    with pytest.raises(
        ModelError, match=r"rope=dynamic:2: vLLM has angles up to the original length .* use yarn:2"
    ):
        rope_overrides(config, "dynamic:2")


def test_three_axes_of_another_family_are_not_extended_unknown():
    config = _qwen("yarn:2")
    config.model_type = "qwen9_vl"
    with pytest.raises(
        ModelError, match=r"rope=yarn:2: of qwen9_vl, .* not known whether .* --engine transformers"
    ):
        rope_overrides(config, "yarn:2")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"dtype": "int8"}, "dtype=int8: give one of auto, bfloat16"),
        (
            {"gpu_memory_utilization": "0"},
            "gpu_memory_utilization=0: give a number above 0, at most 1",
        ),
        ({"gpu_memory_utilization": "nan"}, "gpu_memory_utilization=nan"),
        ({"max_model_len": "0"}, "max_model_len=0: give a whole number from 1"),
        ({"tensor_parallel_size": "0"}, "tensor_parallel_size=0: give a whole number from 1"),
        ({"max_frames": "0"}, "max_frames=0: give a whole number from 1"),
        ({"mm_processor_cache_gb": "-1"}, "mm_processor_cache_gb=-1: give a number from 0"),
        ({"data_parallel_size": "2"}, "external_launcher in vLLM; use --workers 2 instead"),
        ({"rope": "yarn"}, "rope=yarn is not TYPE:FACTOR"),
        ({"prompt": "loud"}, "prompt=loud: give chat or plain"),
        ({"max_pixels": "0"}, "max_pixels=0: give a whole number of pixels from 1"),
        ({"device": "cpu"}, "has no option device"),
    ],
)
def test_options_that_cannot_be_are_refused_at_once(settings, message):
    with pytest.raises(UsageError, match=message):
        check_options("qwen2.5-vl@vllm", settings)


@pytest.mark.parametrize("settings", [{"ensemble": "loud"}, {"dtype": "int8"}, {"execute": "0"}])
def test_a_policys_options_are_refused_likewise(settings):
    with pytest.raises(UsageError, match=next(iter(settings))):
        check_options("openvla@vllm", settings)


@pytest.mark.parametrize("name", ["qwen2.5-vl", "llava-onevision", "pixtral", "openvla"])
def test_both_engines_load_the_same_checkpoint_where_none_is_named(name):
    named = [options_of(known)["pretrained"].default for known in (name, f"{name}@vllm")]
    assert named[0] == named[1] != ""
