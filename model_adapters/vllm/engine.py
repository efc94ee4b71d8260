"""The one module that imports vLLM: starts it, asks it, and says in one line what went wrong."""

import gc
import importlib
import multiprocessing
import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from PIL import Image

from infthor_eval.errors import ModelError, wrap_errors

__all__ = ["Engine", "EngineOutput", "EngineRequest", "SamplingSettings", "import_vllm"]


@dataclass(frozen=True)
class EngineRequest:
    """What is to be continued.

    Attributes:
        ids: of the prompt, one placeholder per frame, which vLLM expands.
        images: the frames, in order.
        names: what tells the frames apart, so that vLLM need not hash their pixels; none has it hash them.
    """

    ids: Sequence[int]
    images: Sequence[Image.Image]
    names: Sequence[str] = ()

    def prompt(self) -> dict[str, Any]:
        """As vLLM takes it."""
        prompt: dict[str, Any] = {"prompt_token_ids": list(self.ids)}
        if self.images:
            prompt["multi_modal_data"] = {"image": list(self.images)}
        if self.names:
            prompt["multi_modal_uuids"] = {"image": list(self.names)}
        return prompt


@dataclass(frozen=True, kw_only=True)
class SamplingSettings:
    """How a request is continued.

    Attributes:
        settings: arguments of `vllm.SamplingParams`.
        choices: where there are any, the reply is one of these texts.
    """

    settings: Mapping[str, Any]
    choices: Sequence[str] = ()


@dataclass(frozen=True)
class EngineOutput:
    """What vLLM wrote.

    Attributes:
        ids: the reply's, with the token that ended it.
        text: the reply as vLLM spells it.
        n_context: tokens of the prompt, frames expanded.
        n_cached: how many of them were not encoded again; None where vLLM does not tell.
    """

    ids: tuple[int, ...]
    text: str
    n_context: int
    n_cached: int | None


def import_vllm(name: str) -> Any:
    """The package, or a line that says how to get it.

    Args:
        name: of the model, for the message.

    Raises:
        ModelError: it is not installed, or does not import.
    """
    os.environ.setdefault("VLLM_LOGGING_STREAM", "ext://sys.stderr")  # tables go to standard output
    if multiprocessing.current_process().daemon:  # a worker of --workers, which may start no process of its own
        os.environ.setdefault("VLLM_ENABLE_V1_MULTIPROCESSING", "0")
    mend = "pip install 'infthor-eval[vllm]', on a machine that vLLM runs on"
    with wrap_errors(
        f"{name} needs the package vllm", mend, catch=(ImportError, OSError, RuntimeError), raise_as=ModelError
    ):
        return importlib.import_module("vllm")


class Engine:
    """A model in vLLM.

    Args:
        name: the registry's name, for messages.
        arguments: of `vllm.LLM`.

    Attributes:
        version: vLLM's.
        batch_invariant: whether vLLM was told to compute a request the same way whatever is run beside it.

    Raises:
        ModelError: vLLM is not there, or does not start.
    """

    def __init__(self, name: str, arguments: Mapping[str, Any]) -> None:
        self._name = name
        self._vllm = import_vllm(name)
        self.version = str(self._vllm.__version__)
        self.batch_invariant = os.environ.get("VLLM_BATCH_INVARIANT", "0") not in ("", "0")
        less = "read above what it printed; for less memory, a smaller max_model_len or max_frames"
        with self._naming("does not start", less):
            self._llm = self._vllm.LLM(**arguments)

    def generate(self, requests: Sequence[EngineRequest], sampling: SamplingSettings) -> list[EngineOutput]:
        """Continue all requests, each for itself.

        Raises:
            ModelError: vLLM refuses one, memory ran out, or it died; nothing is answered then.
        """
        if not requests:
            return []
        with self._naming("fails on the request", "ask with fewer frames, or start the command again, which goes on"):
            outputs = self._llm.generate(
                [request.prompt() for request in requests], sampling_params=self._params(sampling), use_tqdm=False
            )
            return [_written(output) for output in outputs]

    def close(self) -> None:
        """Give the memory back: vLLM ends its processes with the last reference to it."""
        del self._llm
        gc.collect()

    def _params(self, sampling: SamplingSettings) -> Any:
        settings = dict(sampling.settings)
        if sampling.choices:
            params = importlib.import_module("vllm.sampling_params")
            settings["structured_outputs"] = params.StructuredOutputsParams(choice=list(sampling.choices))
        return self._vllm.SamplingParams(**settings)

    def _naming(self, what: str, mend: str) -> AbstractContextManager[None]:
        # vLLM's errors have no common base, and some come from torch or from the processes that it started.
        return wrap_errors(f"{self._name}: vLLM {self.version} {what}", mend, catch=Exception, raise_as=ModelError)


def _written(output: Any) -> EngineOutput:
    reply = output.outputs[0]
    return EngineOutput(tuple(reply.token_ids), reply.text, len(output.prompt_token_ids), output.num_cached_tokens)
