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
_SERVED = "any model behind a server of this dialect (model=NAME)"
_HTTP = "any policy behind a server of OpenVLA's convention, /act (url=ADDRESS)"
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


def _locate(adapter: str, options: str, description: str = "") -> BuiltIn:
    """Return a model's classes, which are given by their places in this package."""
    return BuiltIn(f"model_adapters.{adapter}", f"model_adapters.{options}", description)


def _named(
    pretrained: str, *model_types: str, options: str = "HfVlmOptions", **defaults: Any
) -> BuiltIn:
    """Return a model that runs as `hf-vlm` does.

    Its usual checkpoint is the one of its public documents that is nearest to eight billion weights
    in use, as those of the paper are; of Mistral Small and Llama 4 it is the smallest. Image sizes,
    system prompts, end tokens and penalties are those of the checkpoint's own files.
    """
    located = _locate("hf.families.hf_vlm:HfVlm", f"options.families:{options}")
    return located._replace(
        defaults={"pretrained": pretrained, **defaults}, model_types=model_types
    )


BUILT_IN = {
    "anthropic": _locate("served.adapters:Anthropic", "served.options:AnthropicOptions", _SERVED),
    "deepseek-vl": _locate(
        "hf.families.deepseek_vl:DeepseekVL", "options.families:DeepseekVLOptions"
    ),
    "deepseek-vl-tiny": _locate(
        "tiny.deepseek_vl:DeepseekVLTiny", "options.tiny:TinyOptions", _RANDOM
    ),
    "gemini": _locate("served.adapters:Gemini", "served.options:GeminiOptions", _SERVED),
    "gemma3": _named("google/gemma-3-12b-it", "gemma3"),
    "gemma4": _named("google/gemma-4-E4B-it", "gemma4", options="Gemma4Options"),
    "glm-4.6v": _named("zai-org/GLM-4.6V-Flash", "glm4v", "glm4v_moe", "glm46v"),
    "hf-vlm": _locate("hf.families.hf_vlm:HfVlm", "options.families:HfVlmOptions", _ANY),
    "hf-vlm@vllm": _locate("vllm.adapter:HfVlmOnVllm", "vllm.options:HfVlmOnVllmOptions", _ANY),
    "human": _locate("human.adapter:Human", "human.adapter:HumanOptions", _PERSON),
    "internvl3.5": _named("OpenGVLab/InternVL3_5-8B-HF", "internvl"),
    "llama4": _named("meta-llama/Llama-4-Scout-17B-16E-Instruct", "llama4"),
    "llava-onevision": _locate(
        "hf.families.llava_onevision:LlavaOnevision", "options.families:LlavaOnevisionOptions"
    ),
    "llava-onevision@vllm": _locate(
        "vllm.adapter:LlavaOnevisionOnVllm", "vllm.options:LlavaOnevisionOnVllmOptions"
    ),
    "llava-onevision-tiny": _locate(
        "tiny.llava_onevision:LlavaOnevisionTiny", "options.tiny:TinyOptions", _RANDOM
    ),
    "mistral-small": _named("mistralai/Mistral-Small-3.1-24B-Instruct-2503", "mistral3"),
    # All its images are seen together, so that prefixes cannot be shared.
    "molmo2": _named("allenai/Molmo2-8B", "molmo2", share_prefix=False),
    "openai": _locate("served.adapters:OpenAI", "served.options:OpenAIOptions", _SERVED),
    "openvla": _locate("policies.openvla.adapter:OpenVLA", "options.policies:OpenVLAOptions"),
    "openvla@vllm": _locate("vllm.openvla:OpenVLAOnVllm", "vllm.options:OpenVLAOnVllmOptions"),
    "openvla-tiny": _locate("tiny.openvla:OpenVLATiny", "options.tiny:OpenVLATinyOptions", _RANDOM),
    "pixtral": _locate("hf.families.pixtral:Pixtral", "options.families:PixtralOptions"),
    "pixtral@vllm": _locate("vllm.adapter:PixtralOnVllm", "vllm.options:PixtralOnVllmOptions"),
    "pixtral-tiny": _locate("tiny.pixtral:PixtralTiny", "options.tiny:TinyOptions", _RANDOM),
    "qwen2.5-vl": _locate("hf.families.qwen2_5_vl:Qwen25VL", "options.families:Qwen25VLOptions"),
    "qwen2.5-vl@vllm": _locate("vllm.adapter:Qwen25VLOnVllm", "vllm.options:Qwen25VLOnVllmOptions"),
    "qwen2.5-vl-nano": _locate(
        "hf.families.qwen2_5_vl:Qwen25VLNano", "options.families:Qwen25VLNanoOptions", _NANO
    ),
    "qwen2.5-vl-tiny": _locate(
        "tiny.qwen2_5_vl:Qwen25VLTiny", "options.tiny:Qwen25VLTinyOptions", _RANDOM
    ),
    "qwen3-vl": _named("Qwen/Qwen3-VL-8B-Instruct", "qwen3_vl", options="PixelVlmOptions"),
    "qwen3-vl-moe": _named(
        "Qwen/Qwen3-VL-30B-A3B-Instruct", "qwen3_vl_moe", options="PixelVlmOptions"
    ),
    "qwen3.5": _named("Qwen/Qwen3.5-9B", "qwen3_5", "qwen3_5_moe", options="PixelVlmOptions"),
    "smolvlm2": _named("HuggingFaceTB/SmolVLM2-2.2B-Instruct", "smolvlm"),
    "spatialvla": _locate(
        "policies.spatialvla.adapter:SpatialVLA", "options.policies:SpatialVLACheckpointOptions"
    ),
    "spatialvla-tiny": _locate(
        "tiny.spatialvla:SpatialVLATiny", "options.tiny:SpatialVLATinyOptions", _RANDOM
    ),
    "vla-http": _locate("policies.http.adapter:VlaHttp", "options.policies:VlaHttpOptions", _HTTP),
}
