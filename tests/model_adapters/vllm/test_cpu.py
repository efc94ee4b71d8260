"""What vLLM's CPU back end finds in the modules that are loaded beside it."""

import sys
from types import SimpleNamespace

import numba  # noqa: F401 - imports llvmlite, as scaling frames does
import pytest
from llvmlite.binding import ffi
from transformers.models.gemma4.configuration_gemma4 import Gemma4TextConfig
from transformers.models.qwen2.configuration_qwen2 import Qwen2Config

from infthor_eval.errors import ModelError
from model_adapters.vllm.cpu import check_kernels, readable_globals


def test_no_value_claims_to_have_what_it_has_not():
    assert hasattr(ffi.lib, "__dict__")  # vLLM would read a dictionary from it
    with readable_globals():
        assert not hasattr(ffi.lib, "__dict__")
        assert callable(ffi.lib.LLVMPY_GetVersionInfo)
    assert hasattr(ffi.lib, "__dict__")


class _Convertor:
    def __init__(self, config, text_config):
        self._masks = getattr(text_config, "use_bidirectional_attention", None)

    def is_mm_prefix_lm(self):
        return self._masks == "vision"


@pytest.fixture
def kernels(monkeypatch):
    backend = SimpleNamespace(
        get_supported_head_sizes=lambda: [32, 64], supports_mm_prefix=lambda: False
    )
    convertors = {"gemma4_text": _Convertor}
    base = SimpleNamespace(is_mm_prefix_lm=lambda: False)
    for name, module in {
        "vllm.v1.attention.backends.cpu_attn": SimpleNamespace(CPUAttentionBackend=backend),
        "vllm.transformers_utils.model_arch_config_convertor": SimpleNamespace(
            MODEL_ARCH_CONFIG_CONVERTORS=convertors,
            ModelArchConfigConvertorBase=lambda config, text_config: base,
        ),
    }.items():
        monkeypatch.setitem(sys.modules, name, module)


def _gemma(**settings):
    layers = ["sliding_attention", "full_attention"]
    return Gemma4TextConfig(num_hidden_layers=2, layer_types=layers, head_dim=32, **settings)


@pytest.mark.usefixtures("kernels")
def test_heads_without_a_kernel_are_refused_in_whichever_layer():
    check_kernels("m", Qwen2Config(hidden_size=256, num_attention_heads=4))
    with pytest.raises(ModelError, match="heads have 16 numbers"):
        check_kernels("m", Qwen2Config(hidden_size=64, num_attention_heads=4))
    check_kernels("m", _gemma(global_head_dim=64))
    with pytest.raises(ModelError, match="heads have 512 numbers"):
        check_kernels("m", _gemma(global_head_dim=512))


@pytest.mark.usefixtures("kernels")
def test_a_model_that_looks_both_ways_within_a_frame_is_refused():
    with pytest.raises(ModelError, match=r"it looks both ways within a frame, .* transformers"):
        check_kernels("m", _gemma(global_head_dim=64, use_bidirectional_attention="vision"))
