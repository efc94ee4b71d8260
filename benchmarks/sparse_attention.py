"""What sparse attention costs by the length of a context: seconds of attention, and the cache.

    python -m benchmarks.sparse_attention [--tokens 8000,32000] [--attention all,window:4096]

A language model with random weights, four layers of 16 heads of 64 (4 of keys), reads random words
by the harness's own encoding, in chunks of 1,024. `all` is dense attention by torch's kernel. Times
are of attention alone, all layers together.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from transformers import AutoModelForCausalLM, Qwen2Config
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from model_adapters import load
from model_adapters.hf.cached.kv_cache import BufferedLayer
from model_adapters.hf.sparse.reading import SparseReading
from model_adapters.tiny.tokenizer import train_tokenizer

DENSE = "all"


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


def save_model(folder: Path) -> None:
    """Save a language model with random weights whose cost is attention."""
    tokenizer = train_tokenizer(
        ("<s>", "<end>", "<pad>"), end="<end>", pad="<pad>", begin="<s>", named={}
    )
    tokenizer.save_pretrained(folder)
    torch.manual_seed(0)
    config = Qwen2Config(
        vocab_size=len(tokenizer),
        hidden_size=256,
        intermediate_size=256,
        num_hidden_layers=4,
        num_attention_heads=16,
        num_key_value_heads=4,
        head_dim=64,
        max_position_embeddings=2**20,
    )
    AutoModelForCausalLM.from_config(config).save_pretrained(folder)


def measure(folder: Path, attention: str, n_tokens: int) -> tuple[float, int]:
    """Return the seconds of attention of reading so many tokens, and the bytes of the cache."""
    options = {"pretrained": str(folder), "prompt": "plain", "device": "cpu"}
    if attention != DENSE:
        options["attention"] = attention
    model: Any = load("hf-lm", options, 0)
    clock = Clock()
    words = torch.randint(5, 200, (n_tokens,), generator=torch.Generator().manual_seed(1)).tolist()
    dense = ALL_ATTENTION_FUNCTIONS["sdpa"]
    sparse = SparseReading._attention
    ALL_ATTENTION_FUNCTIONS["sdpa"] = clock.timed(dense)
    SparseReading._attention = clock.timed(sparse)  # type: ignore[method-assign]
    try:
        model.forget()
        model._prefix.feed(words)
    finally:
        ALL_ATTENTION_FUNCTIONS["sdpa"] = dense
        SparseReading._attention = sparse  # type: ignore[method-assign]
    layers = [it for it in model._prefix.cache.layers if isinstance(it, BufferedLayer)]
    n_bytes = sum(layer.n_bytes for layer in layers)
    model.close()
    return clock.seconds, n_bytes


def main() -> None:
    """Print a row for each attention."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tokens", default="8000,32000")
    parser.add_argument("--attention", default=f"{DENSE},sinks:64+window:4096,sinks:64+window:1024")
    parser.add_argument("--dense-up-to", type=int, default=32_000)
    arguments = parser.parse_args()
    lengths = [int(text) for text in arguments.tokens.split(",")]
    with tempfile.TemporaryDirectory() as folder:
        save_model(Path(folder))
        for attention in arguments.attention.split(","):
            for n_tokens in lengths:
                if attention == DENSE and n_tokens > arguments.dense_up_to:
                    continue
                seconds, n_bytes = measure(Path(folder), attention, n_tokens)
                print(f"{attention}, {n_tokens:,} tokens: {seconds:.1f} s, {n_bytes / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
