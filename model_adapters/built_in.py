"""Built-in models by name.

To add or change the description of a model in `ls models`: `description` of its line here; without
one, its usual checkpoint is shown.
"""

from typing import NamedTuple

__all__ = ["BUILT_IN", "BuiltIn"]


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
    """

    adapter: str
    options: str
    description: str = ""

    @property
    def note(self) -> str:
        """Warning for users of the model, or an empty text."""
        return self.description if self.description == _RANDOM else ""


def _locate(adapter: str, options: str, description: str = "") -> BuiltIn:
    """Return a model's classes, which are given by their places in this package."""
    return BuiltIn(f"model_adapters.{adapter}", f"model_adapters.{options}", description)


BUILT_IN = {
    "anthropic": _locate("served.adapters:Anthropic", "served.options:AnthropicOptions", _SERVED),
    "deepseek-vl": _locate(
        "hf.families.deepseek_vl:DeepseekVL", "options.families:DeepseekVLOptions"
    ),
    "deepseek-vl-tiny": _locate(
        "tiny.deepseek_vl:DeepseekVLTiny", "options.tiny:TinyOptions", _RANDOM
    ),
    "gemini": _locate("served.adapters:Gemini", "served.options:GeminiOptions", _SERVED),
    "gemma3": _locate("hf.families.named:Gemma3", "options.named:Gemma3Options"),
    "gemma4": _locate("hf.families.named:Gemma4", "options.named:Gemma4Options"),
    "glm-4.6v": _locate("hf.families.named:Glm46V", "options.named:Glm46VOptions"),
    "hf-vlm": _locate("hf.families.hf_vlm:HfVlm", "options.families:HfVlmOptions", _ANY),
    "hf-vlm@vllm": _locate("vllm.adapter:HfVlmOnVllm", "vllm.options:HfVlmOnVllmOptions", _ANY),
    "human": _locate("human.adapter:Human", "human.adapter:HumanOptions", _PERSON),
    "internvl3.5": _locate("hf.families.named:InternVL35", "options.named:InternVL35Options"),
    "llama4": _locate("hf.families.named:Llama4", "options.named:Llama4Options"),
    "llava-onevision": _locate(
        "hf.families.llava_onevision:LlavaOnevision", "options.families:LlavaOnevisionOptions"
    ),
    "llava-onevision@vllm": _locate(
        "vllm.adapter:LlavaOnevisionOnVllm", "vllm.options:LlavaOnevisionOnVllmOptions"
    ),
    "llava-onevision-tiny": _locate(
        "tiny.llava_onevision:LlavaOnevisionTiny", "options.tiny:TinyOptions", _RANDOM
    ),
    "mistral-small": _locate("hf.families.named:MistralSmall", "options.named:MistralSmallOptions"),
    "molmo2": _locate("hf.families.named:Molmo2", "options.named:Molmo2Options"),
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
    "qwen3-vl": _locate("hf.families.named:Qwen3VL", "options.named:Qwen3VLOptions"),
    "qwen3-vl-moe": _locate("hf.families.named:Qwen3VLMoe", "options.named:Qwen3VLMoeOptions"),
    "qwen3.5": _locate("hf.families.named:Qwen35", "options.named:Qwen35Options"),
    "smolvlm2": _locate("hf.families.named:SmolVLM2", "options.named:SmolVLM2Options"),
    "spatialvla": _locate(
        "policies.spatialvla.adapter:SpatialVLA", "options.policies:SpatialVLACheckpointOptions"
    ),
    "spatialvla-tiny": _locate(
        "tiny.spatialvla:SpatialVLATiny", "options.tiny:SpatialVLATinyOptions", _RANDOM
    ),
    "vla-http": _locate("policies.http.adapter:VlaHttp", "options.policies:VlaHttpOptions", _HTTP),
}
