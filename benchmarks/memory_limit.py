"""What happens when memory runs out on a context.

The request fails alone, and nothing is lost; with the keys and values in the machine's own memory
the same context is answered.

    python benchmarks/memory_limit.py --device cuda --model-size 7b --frames 1040 --gib 21
    python benchmarks/memory_limit.py --pretend-at 2000

A Qwen2.5-VL with random weights is asked on all frames, on a few, and again on a few. On a GPU the
process may take no more than --gib of its memory. A CPU swaps instead of refusing; there the model
is told that memory is out once its cache holds --pretend-at tokens on the device.
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from noise_set import write_frames
from prefix_sharing import build
from prefix_ways import clear_cache, timed

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Decoding
from model_adapters.hf.cached.model import TransformersModel

_FEW = 8  # frames of the short context


def main() -> None:
    """Ask on the long and the short context, without and with the cache in the machine's memory."""
    options = _arguments()
    torch.set_num_threads(options.threads)
    with tempfile.TemporaryDirectory() as folder:
        frames = [FrameRef(path) for path in write_frames(Path(folder), options.frames)]
        model = build(options)
        _answer(model, frames[:_FEW])
        if options.gib is not None:
            total = torch.cuda.get_device_properties(options.device).total_memory / 2**30
            torch.cuda.set_per_process_memory_fraction(min(1.0, options.gib / total))
        hooks = [] if options.pretend_at is None else [_pretend(model, options.pretend_at)]
        found = _without_offload(model, frames, options.device)
        # In the machine's memory the cache takes none of the device's.
        for hook in hooks:
            hook.remove()
        offloading = TransformersModel(
            model.name, model._loaded, replace(model._options, kv_offload=True)
        )
        found |= _with_offload(offloading, frames)
    print(json.dumps(found))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--model-size", choices=("tiny", "7b"), default="tiny")
    limits = parser.add_mutually_exclusive_group(required=True)
    limits.add_argument("--gib", type=float, help="GPU memory that the process may take")
    limits.add_argument("--pretend-at", type=int, metavar="TOKENS")
    parser.set_defaults(
        seed=0, attention="sdpa", chunk_tokens=[None], batch_size=[1], margins=False
    )
    return parser.parse_args()


def _without_offload(
    model: TransformersModel, frames: Sequence[FrameRef], device: str
) -> dict[str, Any]:
    clear_cache(model)
    before = _allocated(device)
    try:
        _answer(model, frames)
        failure = None
    except ModelError as error:
        failure = str(error)
    seconds, tokens = _answer(model, frames[:_FEW])
    clear_cache(model)
    return {
        "failure": failure,
        "next answered": tokens > 0,
        "next seconds": seconds,
        "kept MiB": (_allocated(device) - before) / 2**20,
    }


def _with_offload(model: TransformersModel, frames: Sequence[FrameRef]) -> dict[str, Any]:
    try:
        seconds, tokens = _answer(model, frames)
    except ModelError as error:
        return {"offload failure": str(error)}
    return {"offload failure": None, "offload tokens": tokens, "offload rate": tokens / seconds}


def _answer(model: TransformersModel, frames: Sequence[FrameRef]) -> tuple[float, int]:
    """Return the seconds of one reply, and the tokens of its context."""

    def ask() -> int:
        talk = model.conversation()
        talk.append(*frames, "\nWhat?")
        return talk.reply(Decoding(max_new_tokens=2)).n_context_tokens or 0

    return timed(ask)


def _allocated(device: str) -> int:
    return torch.cuda.memory_allocated() if device.startswith("cuda") else 0


def _pretend(model: TransformersModel, n_tokens: int) -> Any:
    """Raise what torch raises on a GPU once a pass would fill the cache beyond some tokens."""

    def refuse(_: Any, __: Any, named: dict[str, Any]) -> None:
        cache = named.get("past_key_values")
        if cache is not None and cache.get_seq_length() > n_tokens:
            raise torch.OutOfMemoryError("memory is out (pretended)")

    return model._loaded.model.register_forward_pre_hook(refuse, with_kwargs=True)


if __name__ == "__main__":
    main()
