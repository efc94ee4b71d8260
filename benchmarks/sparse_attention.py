"""What sparse attention costs by the length of a context: seconds of attention, and the cache.

    python -m benchmarks.sparse_attention [--tokens 8000,32000] [--attention all,window:4096]
    python -m benchmarks.sparse_attention --attention all --decoder nemotron_h

A language model with random weights, four layers of 16 heads of 64 (4 of keys), reads random words
by the harness's own encoding, in chunks of 1,024. `all` is dense attention by torch's kernel. Times
are of attention alone, all layers together, and of all of encoding.

On a GPU (not run yet; rehearsed here with `--shape small --tokens 2000`), six minutes at most:

    python -m benchmarks.sparse_attention --device cuda --dtype bfloat16 --shape 7b \\
        --tokens 64000,256000 --dense-up-to 256000 --check
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import torch
from transformers import AutoConfig, AutoModelForCausalLM
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from model_adapters import load
from model_adapters.hf.cached.kv_cache import BufferedLayer
from model_adapters.hf.sparse.chosen import ChosenAttention
from model_adapters.hf.sparse.window import WindowAttention
from model_adapters.tiny.tokenizer import train_tokenizer

DENSE = "all"
SHAPES: dict[str, dict[str, int]] = {
    "small": {
        "hidden_size": 256,
        "intermediate_size": 256,
        "num_hidden_layers": 4,
        "num_attention_heads": 16,
        "num_key_value_heads": 4,
        "head_dim": 64,
    },
    "7b": {  # of Qwen2.5
        "hidden_size": 3584,
        "intermediate_size": 18944,
        "num_hidden_layers": 28,
        "num_attention_heads": 28,
        "num_key_value_heads": 4,
    },
}
# What decoders have beside a shape: layers without keys, as far as published ones mix them.
DECODERS: dict[str, dict[str, Any]] = {
    "qwen2": {},
    "qwen3_5_text": {
        "layer_types": [*["linear_attention"] * 3, "full_attention"],
        **{f"linear_num_{what}_heads": 8 for what in ("key", "value")},
        **{f"linear_{what}_head_dim": 64 for what in ("key", "value")},
    },
    "lfm2": {"layer_types": [*["conv"] * 3, "full_attention"]},
    "nemotron_h": {
        "layers_block_type": [*["linear_attention"] * 3, "full_attention"],
        "ssm_state_size": 64,
        "mamba_num_heads": 16,
        "mamba_head_dim": 32,
        "n_groups": 2,
    },
}


class Clock:
    """Seconds that calls of a function took."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, whose calls are timed."""

        def call(*arguments: Any, **options: Any) -> Any:
            start = time.perf_counter()
            result = function(*arguments, **options)
            self.seconds += time.perf_counter() - start
            return result

        return call

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Time dense attention by torch, and both kinds of sparse attention, within the context."""
        with pytest.MonkeyPatch.context() as patch:
            dense = ALL_ATTENTION_FUNCTIONS["sdpa"]
            patch.setitem(ALL_ATTENTION_FUNCTIONS, "sdpa", self.timed(dense))
            for rule in (WindowAttention, ChosenAttention):
                patch.setattr(rule, "plan", self._timed_plan(rule.plan))
            yield

    def _timed_plan(self, plan: Callable[..., Any]) -> Callable[..., Any]:
        """Return what makes plans; making one is timed, and what it makes."""
        timed = self.timed(plan)

        def make(*arguments: Any) -> Any:
            return self.timed(timed(*arguments))

        return make


def save_model(folder: Path, decoder: str, shape: str, dtype: torch.dtype) -> None:
    """Save a language model with random weights, of a shape whose cost is attention or of 7B."""
    tokenizer = train_tokenizer(
        ("<s>", "<end>", "<pad>"), end="<end>", pad="<pad>", begin="<s>", named={}
    )
    tokenizer.save_pretrained(folder)
    torch.manual_seed(0)
    settings = {"vocab_size": len(tokenizer), "max_position_embeddings": 2**20}
    config = AutoConfig.for_model(decoder, **settings, **SHAPES[shape], **DECODERS[decoder])
    AutoModelForCausalLM.from_config(config, dtype=dtype).save_pretrained(folder)


class Measured(NamedTuple):
    """Seconds of attention and of encoding, bytes of the cache, and the next token's logits."""

    attention: float
    encoding: float
    n_bytes: int
    logits: torch.Tensor


def measure(folder: Path, attention: str, n_tokens: int, device: str) -> Measured:
    """Return what reading so many tokens takes."""
    options = {"pretrained": str(folder), "prompt": "plain", "device": device}
    if attention != DENSE:
        options["attention"] = attention
    model: Any = load("hf-lm", options, 0)
    clock = Clock()
    words = torch.randint(5, 200, (n_tokens,), generator=torch.Generator().manual_seed(1)).tolist()
    with clock.watching():
        model.forget()
        start = time.perf_counter()
        logits = model._prefix.feed(words).cpu()
        encoding = time.perf_counter() - start
    n_bytes = sum(map(bytes_of, model._prefix.cache.layers))
    model.close()
    return Measured(clock.seconds, encoding, n_bytes, logits)


def bytes_of(layer: Any) -> int:
    """Return the bytes of a layer's keys and values, or of its states."""
    if isinstance(layer, BufferedLayer):
        return layer.n_bytes
    states = [*layer.conv_states.values(), *layer.recurrent_states.values()]
    return sum(state.nbytes for state in states if state is not None)


def check(folder: Path, device: str) -> None:
    """Print whether a window as long as the context has the logits of dense attention."""
    dense = measure(folder, DENSE, 2000, device).logits
    window = measure(folder, "sinks:64+window:2000", 2000, device).logits
    difference = float((window - dense).abs().max() / dense.abs().max())
    print(f"window of all: largest difference of logits {difference:.1e}")


def main() -> None:
    """Print a row for each attention."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tokens", default="8000,32000")
    parser.add_argument("--attention", default=f"{DENSE},sinks:64+window:4096,sinks:64+window:1024")
    parser.add_argument("--dense-up-to", type=int, default=32_000)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--dtype", default="float32")
    parser.add_argument("--shape", choices=SHAPES, default="small")
    parser.add_argument("--decoder", choices=DECODERS, default="qwen2")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    lengths = [int(text) for text in arguments.tokens.split(",")]
    with tempfile.TemporaryDirectory() as folder:
        dtype = getattr(torch, arguments.dtype)
        save_model(Path(folder), arguments.decoder, arguments.shape, dtype)
        if arguments.check:
            check(Path(folder), arguments.device)
        for attention in arguments.attention.split(","):
            for n_tokens in lengths:
                if attention == DENSE and n_tokens > arguments.dense_up_to:
                    continue
                found = measure(Path(folder), attention, n_tokens, arguments.device)
                peak = ""
                if arguments.device.startswith("cuda"):
                    peak = f", peak {torch.cuda.max_memory_allocated() / 1e9:.1f} GB"
                    torch.cuda.reset_peak_memory_stats()
                print(
                    f"{attention}, {n_tokens:,} tokens: attention {found.attention:.1f} s, all "
                    f"{found.encoding:.1f} s, cache {found.n_bytes / 1e6:.1f} MB{peak}"
                )


if __name__ == "__main__":
    main()
