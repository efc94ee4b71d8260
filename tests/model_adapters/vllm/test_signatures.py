"""How signatures are read: from syntax alone, of a wheel made here."""

import zipfile

from . import read_signatures

FILES = {
    "vllm/entrypoints/llm.py": (
        "class LLM:\n"
        "    def __init__(self, model, *, seed=0, **kwargs): ...\n"
        "    @overload\n"
        "    def generate(self, prompts): ...\n"
        "    def generate(self, prompts, sampling_params=None, *, use_tqdm=True): ...\n"
        "    def chat(self, messages): ...\n"
    ),
    "vllm/engine/arg_utils.py": (
        "class EngineArgs:\n    model: str = 1\n    x: ClassVar[int] = 2\n    _y: int = 3\n"
    ),
    "vllm/sampling_params.py": (
        "class SamplingParams:\n    n: int\nclass StructuredOutputsParams:\n    choice: list\n"
    ),
    "vllm/outputs.py": (
        "class RequestOutput:\n"
        "    def __init__(self, request_id, *, more=None): ...\n"
        "class CompletionOutput:\n"
        "    text: str\n"
    ),
    "vllm/inputs/llm.py": (
        "class Base(TypedDict):\n"
        "    a: int\n"
        "class TokensPrompt(Base):\n"
        "    prompt_token_ids: list\n"
    ),
}


def test_names_come_from_syntax(tmp_path):
    wheel = tmp_path / "vllm-9.8.7-cp38-abi3-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, text in FILES.items():
            archive.writestr(name, text)
    assert read_signatures.signatures(wheel) == {
        "version": "9.8.7",
        "LLM": ["model", "seed"],
        "LLM.generate": ["prompts", "sampling_params", "use_tqdm"],
        "LLM.chat": ["messages"],
        "EngineArgs": ["model"],
        "SamplingParams": ["n"],
        "StructuredOutputsParams": ["choice"],
        "RequestOutput": ["request_id", "more"],
        "CompletionOutput": ["text"],
        "TokensPrompt": ["a", "prompt_token_ids"],
    }
