"""Built-in models by name."""

from typing import NamedTuple

__all__ = ["BUILT_IN", "BuiltIn"]


_RANDOM = "random weights, for trying the harness; scores are near 0"
_NANO = "small, trained, bundled with the package"


class BuiltIn(NamedTuple):
    """Locations of a model's classes, as "module:Class"; each is imported when it is needed.

    Attributes:
        adapter: adapter of the model.
        options: `Options` of the adapter, in a module that imports nothing slow.
        description: what the model is, in a few words, if its name does not say so.
    """

    adapter: str
    options: str
    description: str = ""

    @property
    def note(self) -> str:
        """Warning for users of the model, or an empty text."""
        return self.description if self.description == _RANDOM else ""


BUILT_IN = {
    "deepseek-vl": BuiltIn(
        "model_adapters.hf.families.deepseek_vl:DeepseekVL", "model_adapters.options.families:DeepseekVLOptions"
    ),
    "deepseek-vl-tiny": BuiltIn(
        "model_adapters.tiny.deepseek_vl:DeepseekVLTiny", "model_adapters.options.tiny:TinyOptions", _RANDOM
    ),
    "hf-vlm": BuiltIn("model_adapters.hf.families.hf_vlm:HfVlm", "model_adapters.options.families:HfVlmOptions"),
    "hf-vlm@vllm": BuiltIn("model_adapters.vllm.adapter:HfVlmOnVllm", "model_adapters.vllm.options:HfVlmOnVllmOptions"),
    "llava-onevision": BuiltIn(
        "model_adapters.hf.families.llava_onevision:LlavaOnevision",
        "model_adapters.options.families:LlavaOnevisionOptions",
    ),
    "llava-onevision@vllm": BuiltIn(
        "model_adapters.vllm.adapter:LlavaOnevisionOnVllm", "model_adapters.vllm.options:LlavaOnevisionOnVllmOptions"
    ),
    "llava-onevision-tiny": BuiltIn(
        "model_adapters.tiny.llava_onevision:LlavaOnevisionTiny", "model_adapters.options.tiny:TinyOptions", _RANDOM
    ),
    "openai": BuiltIn("model_adapters.openai.adapter:OpenAI", "model_adapters.openai.options:OpenAIOptions"),
    "openvla": BuiltIn(
        "model_adapters.policies.openvla.adapter:OpenVLA", "model_adapters.options.policies:OpenVLAOptions"
    ),
    "openvla@vllm": BuiltIn(
        "model_adapters.vllm.openvla:OpenVLAOnVllm", "model_adapters.vllm.options:OpenVLAOnVllmOptions"
    ),
    "openvla-tiny": BuiltIn(
        "model_adapters.tiny.openvla:OpenVLATiny", "model_adapters.options.tiny:OpenVLATinyOptions", _RANDOM
    ),
    "pixtral": BuiltIn("model_adapters.hf.families.pixtral:Pixtral", "model_adapters.options.families:PixtralOptions"),
    "pixtral@vllm": BuiltIn(
        "model_adapters.vllm.adapter:PixtralOnVllm", "model_adapters.vllm.options:PixtralOnVllmOptions"
    ),
    "pixtral-tiny": BuiltIn(
        "model_adapters.tiny.pixtral:PixtralTiny", "model_adapters.options.tiny:TinyOptions", _RANDOM
    ),
    "qwen2.5-vl": BuiltIn(
        "model_adapters.hf.families.qwen2_5_vl:Qwen25VL", "model_adapters.options.families:Qwen25VLOptions"
    ),
    "qwen2.5-vl@vllm": BuiltIn(
        "model_adapters.vllm.adapter:Qwen25VLOnVllm", "model_adapters.vllm.options:Qwen25VLOnVllmOptions"
    ),
    "qwen2.5-vl-nano": BuiltIn(
        "model_adapters.tiny.qwen2_5_vl_nano:Qwen25VLNano", "model_adapters.options.families:Qwen25VLNanoOptions", _NANO
    ),
    "qwen2.5-vl-tiny": BuiltIn(
        "model_adapters.tiny.qwen2_5_vl:Qwen25VLTiny", "model_adapters.options.tiny:Qwen25VLTinyOptions", _RANDOM
    ),
    "spatialvla": BuiltIn(
        "model_adapters.policies.spatialvla.adapter:SpatialVLA",
        "model_adapters.options.policies:SpatialVLACheckpointOptions",
    ),
    "spatialvla-tiny": BuiltIn(
        "model_adapters.tiny.spatialvla:SpatialVLATiny", "model_adapters.options.tiny:SpatialVLATinyOptions", _RANDOM
    ),
    "vla-http": BuiltIn(
        "model_adapters.policies.http.adapter:VlaHttp", "model_adapters.options.policies:VlaHttpOptions"
    ),
}
