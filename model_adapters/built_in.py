"""Built-in models by name.

To add a name for a model that `hf-vlm` runs: a line here, by `_named`, and in `docs/nieh.md`.

To add or change the description of a model in `ls models`: `description` of its line here; without
one, its usual checkpoint is shown.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

_RANDOM = "random weights, for trying the harness; scores are those of chance"
_ANY = "any image-text model of transformers with a chat template (pretrained=NAME)"
_ANY_TEXT = "any language model of transformers, for texts alone (pretrained=NAME)"
_SERVED = "any model behind a server of this dialect (model=NAME)"
_HTTP = "any policy behind a server of OpenVLA's convention, /act (url=ADDRESS)"
_VLA_EVAL = "any policy behind a model server of vla-eval (url=ADDRESS)"
_OPENPI = "any policy behind openpi's server (url=ADDRESS)"
_PERSON = "a person, who answers on a page of this machine"
_NANO = "small, trained, bundled with the package"


class BuiltIn(NamedTuple):
    """Locations of a model's classes, as "module:Class"; each is imported when it is needed.

    Attributes:
        adapter: adapter of the model.
        options: `Options` of the adapter, in a module that imports nothing slow.
        description: what the model is, in a few words, if its name does not say so.
        defaults: defaults of options that are the model's own, such as its usual checkpoint.
        model_types: supported values of `model_type` in configs, where the adapter has no own ones.
    """

    adapter: str
    options: str
    description: str = ""
    defaults: Mapping[str, Any] = MappingProxyType({})
    model_types: tuple[str, ...] = ()

    @property
    def note(self) -> str:
        """Warning for users of the model, or an empty text."""
        return self.description if self.description == _RANDOM else ""


def _locate(adapter: str, options: str, description: str = "", **defaults: Any) -> BuiltIn:
    """Return a model's classes, which are given by their places in this package."""
    return BuiltIn(f"model_adapters.{adapter}", f"model_adapters.{options}", description, defaults)


def _on_vllm(adapter: str, options: str, model: BuiltIn) -> BuiltIn:
    """Return a model of transformers with its weights in vLLM."""
    return _locate(
        f"vllm.{adapter}",
        f"vllm.options:{options}",
        model.description,
        pretrained=model.defaults["pretrained"],
    )


def _tiny(adapter: str, options: str) -> BuiltIn:
    """Return a tiny model, whose weights are drawn by the run's seed.

    It computes in float32, so that replies do not depend on rounding, and on one thread: tiny
    tensors gain nothing from more, and on a busy machine waiting for the slowest one makes each
    operation many times slower.
    """
    return _locate(f"tiny.{adapter}", f"options.{options}", _RANDOM, **_SMALL)


def _named(
    pretrained: str, *model_types: str, options: str = "HfVlmOptions", **defaults: Any
) -> BuiltIn:
    """Return a model that runs as `hf-vlm` does.

    Its usual checkpoint is the one of its public documents that is nearest to eight billion weights
    in use, as those of the paper are; of Mistral Small and Llama 4 it is the smallest. Image sizes,
    system prompts, end tokens and penalties are those of the checkpoint's own files.
    """
    located = _locate(
        "hf.families.hf_vlm:HfVlm",
        f"options.families:{options}",
        pretrained=pretrained,
        **defaults,
    )
    return located._replace(model_types=model_types)


_SMALL = {"dtype": "float32", "device": "cpu", "threads": 1}
_HF_LM = _locate(
    "hf.families.hf_lm:HfLm",
    "options.checkpoints:CheckpointOptions",
    _ANY_TEXT,
    pretrained="",
)
_HF_VLM = _locate("hf.families.hf_vlm:HfVlm", "options.families:HfVlmOptions", _ANY, pretrained="")
_LLAVA_ONEVISION = _locate(
    "hf.families.llava_onevision:LlavaOnevision",
    "options.checkpoints:CheckpointOptions",
    pretrained="llava-hf/llava-onevision-qwen2-7b-ov-hf",
)
_OPENVLA = _locate(
    "policies.openvla.adapter:OpenVLA",
    "options.policies:OpenVLAOptions",
    pretrained="openvla/openvla-7b",
)
_PIXTRAL = _locate(
    "hf.families.pixtral:Pixtral",
    "options.checkpoints:CheckpointOptions",
    pretrained="mistral-community/pixtral-12b",
)
_QWEN_2_5_VL = _locate(
    "hf.families.qwen2_5_vl:Qwen25VL",
    "options.families:PixelOptions",
    pretrained="Qwen/Qwen2.5-VL-7B-Instruct",
)

BUILT_IN = {
    "anthropic": _locate("served.adapters:Anthropic", "served.options:AnthropicOptions", _SERVED),
    "deepseek-vl": _locate(
        "hf.families.deepseek_vl:DeepseekVL",
        "options.checkpoints:CheckpointOptions",
        pretrained="deepseek-community/deepseek-vl-7b-chat",
    ),
    "deepseek-vl-tiny": _tiny("deepseek_vl:DeepseekVLTiny", "checkpoints:HfOptions"),
    "gemini": _locate("served.adapters:Gemini", "served.options:GeminiOptions", _SERVED),
    "gemma3": _named("google/gemma-3-12b-it", "gemma3"),
    "gemma4": _named("google/gemma-4-E4B-it", "gemma4", options="Gemma4Options"),
    "glm-4.6v": _named("zai-org/GLM-4.6V-Flash", "glm4v", "glm4v_moe", "glm46v"),
    "hf-lm": _HF_LM,
    "hf-lm@vllm": _on_vllm("adapter:HfLmOnVllm", "VllmOptions", _HF_LM),
    "hf-vlm": _HF_VLM,
    "hf-vlm@vllm": _on_vllm("adapter:HfVlmOnVllm", "VllmOptions", _HF_VLM),
    "human": _locate("human.adapter:Human", "human.adapter:HumanOptions", _PERSON),
    "internvl3.5": _named("OpenGVLab/InternVL3_5-8B-HF", "internvl"),
    "llama4": _named("meta-llama/Llama-4-Scout-17B-16E-Instruct", "llama4"),
    "llava-onevision": _LLAVA_ONEVISION,
    "llava-onevision@vllm": _on_vllm(
        "adapter:LlavaOnevisionOnVllm", "VllmOptions", _LLAVA_ONEVISION
    ),
    "llava-onevision-tiny": _tiny("llava_onevision:LlavaOnevisionTiny", "checkpoints:HfOptions"),
    "mistral-small": _named("mistralai/Mistral-Small-3.1-24B-Instruct-2503", "mistral3"),
    # All its images are seen together, so that prefixes cannot be shared.
    "molmo2": _named("allenai/Molmo2-8B", "molmo2", share_prefix=False),
    "openai": _locate("served.adapters:OpenAI", "served.options:OpenAIOptions", _SERVED),
    "openpi": _locate("remote_policies.openpi:OpenPi", "options.policies:OpenPiOptions", _OPENPI),
    "openvla": _OPENVLA,
    "openvla@vllm": _on_vllm("openvla:OpenVLAOnVllm", "OpenVLAOnVllmOptions", _OPENVLA),
    "openvla-tiny": _tiny("openvla:OpenVLATiny", "policies:OpenVLATinyOptions"),
    "pixtral": _PIXTRAL,
    "pixtral@vllm": _on_vllm("adapter:PixtralOnVllm", "VllmOptions", _PIXTRAL),
    "pixtral-tiny": _tiny("pixtral:PixtralTiny", "checkpoints:HfOptions"),
    "qwen2.5-vl": _QWEN_2_5_VL,
    "qwen2.5-vl@vllm": _on_vllm("adapter:Qwen25VLOnVllm", "PixelVllmOptions", _QWEN_2_5_VL),
    "qwen2.5-vl-nano": _locate(
        "hf.families.qwen2_5_vl:Qwen25VLNano",
        "options.families:PixelOptions",
        _NANO,
        pretrained="",  # the one that comes with the package
        **_SMALL,
    ),
    "qwen2.5-vl-tiny": _tiny("qwen2_5_vl:Qwen25VLTiny", "families:TinyPixelOptions"),
    "qwen3-vl": _named("Qwen/Qwen3-VL-8B-Instruct", "qwen3_vl", options="PixelVlmOptions"),
    "qwen3-vl-moe": _named(
        "Qwen/Qwen3-VL-30B-A3B-Instruct", "qwen3_vl_moe", options="PixelVlmOptions"
    ),
    "qwen3.5": _named("Qwen/Qwen3.5-9B", "qwen3_5", "qwen3_5_moe", options="PixelVlmOptions"),
    "smolvlm2": _named("HuggingFaceTB/SmolVLM2-2.2B-Instruct", "smolvlm"),
    "spatialvla": _locate(
        "policies.spatialvla.adapter:SpatialVLA",
        "options.policies:SpatialVLACheckpointOptions",
        pretrained="IPEC-COMMUNITY/spatialvla-4b-224-pt",
    ),
    "spatialvla-tiny": _tiny("spatialvla:SpatialVLATiny", "policies:SpatialVLAOptions"),
    "vla-eval": _locate(
        "remote_policies.vla_eval:VlaEval", "options.policies:SocketPolicyOptions", _VLA_EVAL
    ),
    "vla-http": _locate(
        "policies.http.adapter:HttpPolicy", "options.policies:VlaHttpOptions", _HTTP
    ),
}
