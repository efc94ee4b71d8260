"""One training run: from a recipe and sets to a checkpoint that its family's adapter loads."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import torch
import torch.distributed as dist

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.digests import digest
from infthor_eval.formats.files import prepare_folder, write_atomically
from infthor_eval.training.batches import collate
from infthor_eval.training.data import TrainingData, read_training_data
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.export import export, whole_weights
from infthor_eval.training.loop import Loop, LoopSettings, Progress
from infthor_eval.training.lora import add_adapters
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.ranks import assign_ranks
from infthor_eval.training.recipe import Recipe
from infthor_eval.training.starting_model import load_starting_model
from infthor_eval.training.trainer import train_with_trainer
from model_adapters.hf.loaded import Loaded

__all__ = ["TrainingRun", "Watcher", "fine_tune", "prepare_run"]

_ABOUT, _STATES, _CHECKPOINT = "training.json", "states", "checkpoint"
Watcher = Callable[[Progress], None]


@dataclass(frozen=True)
class TrainingRun:
    """A run that can begin.

    Attributes:
        recipe: how to train.
        loaded: the model.
        data: what it is trained on.
    """

    recipe: Recipe
    loaded: Loaded
    data: TrainingData

    def document(self) -> dict[str, Any]:
        """What makes the run another one, as JSON values."""
        names = "\n".join(f"{item.name} {item.n_tokens} {item.n_trained}" for item in self.data.sequences)
        return {
            "recipe": msgspec.to_builtins(self.recipe),
            "model": self.loaded.identity,
            "sequences": len(self.data.sequences),
            "tokens": self.data.n_tokens,
            "trained_tokens": self.data.n_trained,
            "data": digest(names),
            "left_out": dict(self.data.reasons()),
        }


def prepare_run(recipe: Recipe, folders: Sequence[Path]) -> TrainingRun:
    """Load the model and make the sequences.

    Args:
        recipe: how to train.
        folders: of replayed sets.

    Raises:
        UsageError: the recipe names a model or a setting that there is not.
        ModelError: the model cannot be loaded.
        DataError: there is nothing to train on.
    """
    loaded = load_starting_model(recipe.model, recipe.model_args, recipe.prompt, recipe.seed)
    return TrainingRun(recipe, loaded, read_training_data(recipe, Encoder(loaded), folders))


def fine_tune(run: TrainingRun, out: Path, watcher: Watcher) -> Path:
    """Train, and write the checkpoint; the same command goes on where an earlier one ended.

    Every process of a run has to call it (`torchrun`); the first one writes.

    Args:
        run: what is trained on what.
        out: folder of the run: states to go on from, the checkpoint, and what it was made of.
        watcher: is told of every step, in the first process.

    Returns:
        The folder of the checkpoint.

    Raises:
        UsageError: the folder is another run's, or the processes do not fit the recipe.
        DataError: something cannot be read or written.
        ModelError: the model cannot be trained so.
    """
    with _processes():
        is_first = not dist.is_initialized() or dist.get_rank() == 0
        if is_first:
            _claim(prepare_folder(out), run.document())
        network = SequenceModel(run.loaded)
        freeze(network, run.recipe.freeze)
        adapters = add_adapters(network, run.recipe.lora) if run.recipe.lora is not None else None
        if run.recipe.gradient_checkpointing:
            network.gradient_checkpointing_enable()
        _train(run, network, out / _STATES, watcher)
        if adapters is not None:
            adapters.merge()
        weights = whole_weights(run.loaded.model)
        if is_first:
            export(run.loaded, out / _CHECKPOINT, weights)
    return out / _CHECKPOINT


def _train(run: TrainingRun, network: SequenceModel, states: Path, watcher: Watcher) -> None:
    recipe, sequences, pad_id = run.recipe, run.data.sequences, run.loaded.tokenizer.pad_token_id
    if recipe.parallel.context == 1:
        join = partial(collate, family=run.loaded.family, pad_id=pad_id)
        train_with_trainer(network, sequences, lambda items: dict(join(items)), recipe, states, watcher)
        return
    if recipe.lora is not None:
        raise UsageError("a recipe with lora and parallel.context is not there; leave one of them out")
    ranks = assign_ranks(recipe.parallel.context)
    Loop(network, pad_id, sequences, _settings(recipe), states, ranks=ranks, report=watcher).run()


def _settings(recipe: Recipe) -> LoopSettings:
    optimizer = recipe.optimizer
    return LoopSettings(
        learning_rate=optimizer.lr,
        betas=optimizer.betas,
        weight_decay=optimizer.weight_decay,
        clip=optimizer.clip,
        warmup_ratio=optimizer.warmup_ratio,
        epochs=recipe.epochs,
        max_steps=recipe.max_steps,
        sequences_per_step=recipe.sequences_per_step,
        seed=recipe.seed,
        save_every=recipe.save_every,
    )


@contextmanager
def _processes() -> Iterator[None]:
    """The process group of `torchrun`, where it started this process."""
    if "WORLD_SIZE" not in os.environ or dist.is_initialized():
        yield
        return
    dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    try:
        yield
    finally:
        dist.destroy_process_group()


def _claim(out: Path, document: dict[str, Any]) -> None:
    """Write down what the folder's run is of, or see that it is this one."""
    path = out / _ABOUT
    if not path.exists():
        with write_atomically(path) as partial_file:
            partial_file.write_text(json.dumps(document, indent=2, sort_keys=True) + "\n", encoding="utf-8")
        return
    with wrap_errors(f"{path}: not JSON", "give another folder", catch=(OSError, ValueError), raise_as=DataError):
        earlier = json.loads(path.read_text(encoding="utf-8"))
    now = json.loads(json.dumps(document))
    if earlier != now:
        changed = sorted(name for name in now if earlier.get(name) != now[name])
        raise UsageError(f"{out} is a run of another {', '.join(changed)}; give another folder with --out")
