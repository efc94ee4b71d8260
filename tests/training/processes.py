"""What each of several processes does in `test_many_processes.py`; started once for all its
tests."""

import os
from dataclasses import dataclass
from datetime import timedelta
from functools import cache
from pathlib import Path
from typing import Any

import torch
import torch.distributed as dist
from torch import Tensor
from torch.distributed.fsdp import fully_shard
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import InfthorError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.training.batches import Batch, collate, n_labels
from infthor_eval.training.context_parallel import context_parallel
from infthor_eval.training.export import gather_weights
from infthor_eval.training.loop import Loop, LoopSettings, Progress
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.ranks import Ranks, assign_ranks, sum_gradients
from model_adapters.hf.loading.loaded import LoadedCheckpoint

from .twins import PAD, everywhere, gradients_of, loaded, sequence

N_RANKS = 4
RESULTS = "results.pt"
ANSWERS = ("a mug", "a fork and a spoon", "no", "on the counter top", "yes")


@dataclass(frozen=True)
class Case:
    """A sequence, and how a model is trained on it.

    Attributes:
        family: of the model.
        n_frames: in the sequence.
        answer_only: whether loss is taken on the answer alone, which stands in the last chunk; on
            all text else.
        frozen: parts.
        recomputed: whether activations are computed again for the gradient.
    """

    family: str
    n_frames: int
    answer_only: bool = False
    frozen: tuple[str, ...] = ()
    recomputed: bool = False


@dataclass(frozen=True)
class CaseResult:
    """What came of a case: each rank's share of the loss, and the gradients by name."""

    shares: list[float]
    gradients: dict[str, Tensor]


CASES = (
    Case("qwen2.5-vl", 5),
    Case("qwen2.5-vl", 5, answer_only=True, recomputed=True),
    Case("qwen2.5-vl", 5, frozen=("vision", "embeddings"), recomputed=True),
    Case("qwen2.5-vl", 5, frozen=("embeddings", "decoder", "head")),
    Case("qwen2.5-vl", 1, frozen=("embeddings",)),
    Case("qwen2.5-vl", 0, answer_only=True),
    Case("llava-onevision", 2, recomputed=True),
    Case("llava-onevision", 2, answer_only=True, frozen=("vision", "embeddings")),
)


@cache
def _loaded(family: str) -> LoadedCheckpoint:
    return loaded(family)


def model_of(case: Case) -> SequenceModel:
    """The case's model, with no gradients."""
    model = SequenceModel(_loaded(case.family))
    model.zero_grad()
    model.requires_grad_(True)
    freeze(model, case.frozen)
    model.gradient_checkpointing_disable()
    if case.recomputed:
        model.gradient_checkpointing_enable()
    return model.train()


def batch_of(case: Case, frames: list[FrameRef]) -> Batch:
    """The case's sequence."""
    checkpoint = _loaded(case.family)
    encoded = sequence(checkpoint, frames[: case.n_frames])
    return collate([encoded if case.answer_only else everywhere(encoded)], checkpoint.family, PAD)


def train(
    checkpoint: LoadedCheckpoint, folder: Path, frames: list[FrameRef], ranks: Ranks
) -> list[Progress]:
    """Two steps of a loop, the first at learning rate 0: so the optimizer has the sum of gradients
    at equal weights.

    In double precision: what differs in how a processor adds up single ones is as large as a small
    fault would be.
    """
    model = SequenceModel(checkpoint).requires_grad_(True).double()
    model.zero_grad()
    sequences = [
        sequence(checkpoint, frames[: number + 1], answer, f"sequence {number}")
        for number, answer in enumerate(ANSWERS)
    ]
    settings = LoopSettings(learning_rate=1e-3, warmup_ratio=0.5, max_steps=2, sequences_per_step=3)
    steps: list[Progress] = []
    Loop(model, PAD, sequences, settings, folder, ranks=ranks, on_step=steps.append).run()
    return steps


def work(rank: int, folder: Path, frames: list[FrameRef]) -> None:
    """Do a process's part of everything; the first one writes down what came of it."""
    torch.set_num_threads(1)
    os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")
    place = f"file://{folder / 'meeting'}"
    dist.init_process_group("gloo", place, timedelta(seconds=120), world_size=N_RANKS, rank=rank)
    results: dict[Any, Any] = {}
    grids = {n_context: assign_ranks(n_context) for n_context in (2, 4)}
    for case in CASES:
        for n_context, ranks in grids.items():
            results[case, n_context] = _run(case, frames, ranks)
    results["left behind"] = [name for name in ALL_ATTENTION_FUNCTIONS if "context" in name]
    results["loop"] = train(loaded("qwen2.5-vl"), folder / "loop", frames, grids[2])
    results["refused"] = _refusals(frames, grids[2])
    results["out of shards"] = _out_of_shards()
    if rank == 0:
        torch.save(results, folder / RESULTS)
    dist.destroy_process_group()


def _run(case: Case, frames: list[FrameRef], ranks: Ranks) -> CaseResult:
    model, batch = model_of(case), batch_of(case, frames)
    group = ranks.context_group
    assert group is not None
    with context_parallel(model, group) as parallel:
        loss = parallel.loss(batch, n_labels(batch))
        loss.backward()
    sum_gradients(model.parameters(), group)
    shares = [0.0] * ranks.n_context
    dist.all_gather_object(shares, loss.item(), group)
    return CaseResult(shares, gradients_of(model))


def _out_of_shards() -> bool:
    """Whether weights that were shared out over all processes come back whole."""
    model = loaded("qwen2.5-vl").model
    before = {name: tensor.clone() for name, tensor in model.state_dict().items()}
    assert gather_weights(model) is None
    fully_shard(model)
    after = gather_weights(model)
    return after is not None and all(after[name].equal(before[name]) for name in before)


def _refusals(frames: list[FrameRef], ranks: Ranks) -> dict[str, str]:
    case = CASES[0]
    model, batch = model_of(case), batch_of(case, frames)
    assert ranks.context_group is not None
    results = {}
    with context_parallel(model, ranks.context_group) as parallel:
        for layer in model.decoder.layers:
            layer.self_attn.sliding_window = 8
        try:
            parallel.loss(batch, 1)
        except InfthorError as error:
            results["sliding"] = str(error)
    try:
        assign_ranks(3)
    except InfthorError as error:
        results["three"] = str(error)
    return results
