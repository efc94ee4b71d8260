"""Measure the memory of each process when a sequence is split over 1, 2 and 4 processes.

The work is one training step on a sequence of frames and text: forward and backward pass of a tiny
Qwen2.5-VL with more and wider layers, with vision tower and embeddings frozen and the loss on all
text. "Kept" is the memory between the two passes that the gradient needs, without the weights. With
recomputed layers it is little more than the input of each layer. "Peak" is the maximum growth of
the process with recomputed layers (Linux only, VmHWM). Of several processes the largest number is
printed.

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
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Prompter
from model_adapters.registry import read_options
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

N_FRAMES = 8  # different frames, which the sequence repeats
WORDS = 60  # tokens of text after each frame of 121 tokens


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
    """A Qwen2.5-VL with 6 layers of width 256, in which keys and values are a small part, as in
    real models."""

    twin = replace(Qwen25VLTiny.twin, config=_wider)


def main() -> None:
    """Measure and print a row for each number of processes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tokens", type=int, default=4096)
    options = parser.parse_args()
    print(
        f"{'processes':>9} {'kept MB':>9} {'recomputed':>11} {'peak MB':>9} {'seconds':>8} "
        f"{'loss':>9}"
    )
    for n_ranks in (1, 2, 4):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_frames(folder)
            torch.multiprocessing.spawn(measure, (n_ranks, options.tokens, folder), nprocs=n_ranks)
            numbers = [torch.load(folder / f"{rank}.pt") for rank in range(n_ranks)]
        kept, recomputed, peak, seconds = (max(one[field] for one in numbers) for field in range(4))
        loss = sum(one[4] for one in numbers)
        print(
            f"{n_ranks:9} {kept:9.1f} {recomputed:11.1f} {peak:9.0f} {seconds:8.1f} {loss:9.5f}",
            flush=True,
        )


def measure(rank: int, n_ranks: int, n_tokens: int, folder: Path) -> None:
    """Write the numbers of one process: MB kept, kept if recomputed, at the peak; seconds; loss."""
    torch.set_num_threads(1)
    dist.init_process_group("gloo", f"file://{folder / 'meeting'}", world_size=n_ranks, rank=rank)
    loaded = Wider.build("wider", read_options("qwen2.5-vl-tiny", {}), 0)._loaded
    model = SequenceModel(loaded).train()
    freeze(model, ["vision", "embeddings"])
    long, short = (batch_of(loaded, folder, length) for length in (n_tokens, n_tokens // 16))
    group = assign_ranks(n_ranks).context_group or dist.group.WORLD
    model.gradient_checkpointing_enable()
    step(model, short, group)  # allocates what is allocated only once
    before = megabytes("VmRSS")
    (PROCESS / "clear_refs").write_text("5")  # the peak counts from here on
    start = time.perf_counter()
    recomputed, loss = step(model, long, group)
    seconds, peak = time.perf_counter() - start, megabytes("VmHWM") - before
    model.gradient_checkpointing_disable()
    kept, _ = step(model, long, group)
    torch.save((kept, recomputed, peak, seconds, loss), folder / f"{rank}.pt")
    dist.destroy_process_group()


def step(model: SequenceModel, batch: Batch, group: Any) -> tuple[float, float]:
    """Run a forward and backward pass; returns the MB kept in between, and this process's share of
    the loss."""
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
    """Return a sequence of this length, with frames between texts."""
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
    """Write frames of noise."""
    draw = np.random.default_rng(0)
    for number in range(N_FRAMES):
        Image.fromarray(draw.integers(0, 256, (300, 300, 3), dtype=np.uint8)).save(
            folder / f"{number}.png"
        )


if __name__ == "__main__":
    main()
