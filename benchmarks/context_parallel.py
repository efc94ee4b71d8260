"""Memory of each process when one sequence is cut over 1, 2 and 4 of them.

One step of training on a sequence of frames and text: forward and backward pass of a tiny Qwen2.5-VL with more and
wider layers, vision tower and embeddings frozen, loss on all text. "Kept" is what lies in memory between the two passes
for the gradient, without the weights; with layers recomputed it is little more than each layer's input. "Peak" is the
growth of the process at its highest, with layers recomputed (Linux only, VmHWM). Of several processes the largest
counts.

    python benchmarks/context_parallel.py [--tokens 4096]
"""

import argparse
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch.distributed as dist
import torch.multiprocessing
from data_path_memory import PROCESS, megabytes
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.training.batches import Batch, collate, n_labels
from infthor_eval.training.context_parallel import context_parallel
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.ranks import assign_ranks
from model_adapters.hf.loaded import LoadedCheckpoint
from model_adapters.hf.prompt import Prompter
from model_adapters.options.tiny import TinyOptions
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

N_FRAMES = 8  # different ones, which stand in the sequence again and again
WORDS = 60  # tokens of text behind each frame of 121


def _wider(ids: Mapping[str, int], vocabulary: int) -> Any:
    config = Qwen25VLTiny.twin.config(ids, vocabulary)
    text = config.text_config
    text.hidden_size, text.intermediate_size, text.num_hidden_layers = 256, 1024, 6
    text.num_attention_heads, text.num_key_value_heads = 8, 1
    text.layer_types = ["full_attention"] * text.num_hidden_layers
    text.rope_parameters["mrope_section"] = [4, 6, 6]
    text.initializer_range = 0.02
    config.vision_config.out_hidden_size = text.hidden_size
    return config


class Wider(Qwen25VLTiny):
    """A Qwen2.5-VL with 6 layers of 256, of which keys and values are a small part, as in real ones."""

    twin = replace(Qwen25VLTiny.twin, config=_wider)


def main() -> None:
    """Measure and print a row for each number of processes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tokens", type=int, default=4096)
    chosen = parser.parse_args()
    print(f"{'processes':>9} {'kept MB':>9} {'recomputed':>11} {'peak MB':>9} {'seconds':>8} {'loss':>9}")
    for n_ranks in (1, 2, 4):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_frames(folder)
            torch.multiprocessing.spawn(measure, (n_ranks, chosen.tokens, folder), nprocs=n_ranks)
            found = [torch.load(folder / f"{rank}.pt") for rank in range(n_ranks)]
        kept, recomputed, peak, seconds = (max(one[field] for one in found) for field in range(4))
        loss = sum(one[4] for one in found)
        print(f"{n_ranks:9} {kept:9.1f} {recomputed:11.1f} {peak:9.0f} {seconds:8.1f} {loss:9.5f}", flush=True)


def measure(rank: int, n_ranks: int, n_tokens: int, folder: Path) -> None:
    """One process's numbers, written into the folder: MB kept, kept if recomputed, at the peak; seconds; loss."""
    torch.set_num_threads(1)
    dist.init_process_group("gloo", f"file://{folder / 'meeting'}", world_size=n_ranks, rank=rank)
    loaded = Wider.build("wider", TinyOptions(), 0)._loaded
    model = SequenceModel(loaded).train()
    freeze(model, ["vision", "embeddings"])
    long, short = (batch_of(loaded, folder, length) for length in (n_tokens, n_tokens // 16))
    group = assign_ranks(n_ranks).context_group or dist.group.WORLD
    model.gradient_checkpointing_enable()
    step(model, short, group)  # what is made once is made here
    before = megabytes("VmRSS")
    (PROCESS / "clear_refs").write_text("5")  # the peak counts from here on
    began = time.perf_counter()
    recomputed, loss = step(model, long, group)
    seconds, peak = time.perf_counter() - began, megabytes("VmHWM") - before
    model.gradient_checkpointing_disable()
    kept, _ = step(model, long, group)
    torch.save((kept, recomputed, peak, seconds, loss), folder / f"{rank}.pt")
    dist.destroy_process_group()


def step(model: SequenceModel, batch: Batch, group: Any) -> tuple[float, float]:
    """Forward and backward pass; gives MB that were kept in between, and this process's share of the loss."""
    weights = {one.untyped_storage().data_ptr() for one in model.parameters()}
    kept: dict[int, int] = {}

    def keep(tensor: torch.Tensor) -> torch.Tensor:
        storage = tensor.untyped_storage()
        if storage.data_ptr() not in weights:
            kept[storage.data_ptr()] = storage.nbytes()
        return tensor

    with context_parallel(model, group) as parallel:
        with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
            loss = parallel.loss(batch, n_labels(batch))
        loss.backward()
    model.zero_grad()
    return sum(kept.values()) / 1e6, loss.item()


def batch_of(loaded: LoadedCheckpoint, folder: Path, n_tokens: int) -> Batch:
    """A sequence of this length, frames between stretches of text."""
    prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
    frames = [prompter.frame(FrameRef(folder / f"{number}.png")) for number in range(N_FRAMES)]
    pieces: list[Any] = []
    length = number = 0
    while length < n_tokens:
        frame = frames[number % N_FRAMES]
        pieces += [*range(10, 10 + WORDS), frame]
        length, number = length + WORDS + len(frame.ids), number + 1
    trained = tuple(isinstance(piece, int) for piece in pieces)
    return collate([TrainingSequence("long", tuple(pieces), trained)], loaded.family, 0)


def write_frames(folder: Path) -> None:
    """Frames of noise."""
    draw = np.random.default_rng(0)
    for number in range(N_FRAMES):
        Image.fromarray(draw.integers(0, 256, (300, 300, 3), dtype=np.uint8)).save(folder / f"{number}.png")


if __name__ == "__main__":
    main()
