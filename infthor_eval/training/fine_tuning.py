"""A training run: from a recipe and sets to a checkpoint that its family's adapter loads."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import torch
import torch.distributed as dist

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import hold_folder, is_written, write_atomically
from infthor_eval.training.batches import collate
from infthor_eval.training.data import TrainingData, read_training_data
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.export import export, gather_weights
from infthor_eval.training.loop import Loop, LoopSettings, Progress
from infthor_eval.training.lora import add_adapters
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.ranks import assign_ranks
from infthor_eval.training.recipe import Recipe
from infthor_eval.training.starting_model import load_starting_model
from infthor_eval.training.trainer import train_with_trainer
from model_adapters.hf.loading.loaded import LoadedCheckpoint

_DESCRIPTION = "training.json"
_STATES = "states"
_CHECKPOINT = "checkpoint"
StepCallback = Callable[[Progress], None]


@dataclass(frozen=True)
class TrainingRun:
    """A run that is ready to start.

    Attributes:
        recipe: recipe of the run.
        loaded: the model.
        data: training data.
    """

    recipe: Recipe
    loaded: LoadedCheckpoint
    data: TrainingData

    def document(self) -> dict[str, Any]:
        """Return everything that identifies the run, as JSON values."""
        names = "\n".join(
            f"{sequence.name} {sequence.n_tokens} {sequence.n_loss_tokens}"
            for sequence in self.data.sequences
        )
        return {
            "recipe": msgspec.to_builtins(self.recipe),
            "model": self.loaded.identity,
            "sequences": len(self.data.sequences),
            "tokens": self.data.n_tokens,
            "trained_tokens": self.data.n_loss_tokens,
            "data": digest(names),
            "left_out": dict(self.data.skip_reasons()),
        }


def prepare_run(recipe: Recipe, folders: Sequence[Path]) -> TrainingRun:
    """Load the model and build the sequences from folders of replayed sets.

    Raises:
        UsageError: the recipe's model or one of its settings is unknown.
        ModelError: the model cannot be loaded.
        DataError: there is nothing to train on.
    """
    loaded = load_starting_model(
        recipe.model, recipe.model_args, recipe.prompt, recipe.seed, recipe.max_tokens
    )
    return TrainingRun(recipe, loaded, read_training_data(recipe, Encoder(loaded), folders))


def fine_tune(run: TrainingRun, out: Path, on_step: StepCallback) -> Path:
    """Train and write the checkpoint; a run that was stopped resumes from its last state.

    Every process of a run has to call this (`torchrun`); the first one writes.

    Args:
        run: the run.
        out: folder of the run, for its description, states and checkpoint.
        on_step: called after every step, in the first process.

    Returns:
        The folder of the checkpoint.

    Raises:
        UsageError: the folder belongs to another run, or the number of processes does not suit the
            recipe.
        DataError: a file cannot be read or written.
        ModelError: the model cannot be trained in this way.
    """
    with _processes(), ExitStack() as held:
        is_first = not dist.is_initialized() or dist.get_rank() == 0
        if is_first:
            _claim_folder(held.enter_context(hold_folder(out)), run.document())
        network = SequenceModel(run.loaded)
        freeze(network, run.recipe.freeze)
        adapters = add_adapters(network, run.recipe.lora) if run.recipe.lora is not None else None
        if run.recipe.gradient_checkpointing:
            network.gradient_checkpointing_enable()
        _train(run, network, out / _STATES, on_step)
        if adapters is not None:
            adapters.merge_and_unload()
        weights = gather_weights(run.loaded.model)
        if is_first:
            recipe = run.recipe
            export(
                run.loaded,
                out / _CHECKPOINT,
                title=recipe.title,
                words=recipe.words,
                weights=weights,
            )
    return out / _CHECKPOINT


def _train(run: TrainingRun, network: SequenceModel, states: Path, on_step: StepCallback) -> None:
    recipe = run.recipe
    sequences = run.data.sequences
    pad_id = run.loaded.tokenizer.pad_token_id
    if recipe.parallel.context == 1:
        to_batch = partial(collate, family=run.loaded.family, pad_id=pad_id)
        train_with_trainer(
            network, sequences, lambda batch: dict(to_batch(batch)), recipe, states, on_step
        )
        return
    if recipe.lora is not None:
        raise UsageError("lora and parallel.context cannot be combined; leave one of them out")
    ranks = assign_ranks(recipe.parallel.context)
    Loop(network, pad_id, sequences, _settings(recipe), states, ranks=ranks, on_step=on_step).run()


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
    """Join the process group of `torchrun` if it started this process."""
    if "WORLD_SIZE" not in os.environ or dist.is_initialized():
        yield
        return
    dist.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    try:
        yield
    finally:
        dist.destroy_process_group()


def _claim_folder(out: Path, document: dict[str, Any]) -> None:
    """Write the run's description into its folder, or check that the folder belongs to it."""
    path = out / _DESCRIPTION
    if not is_written(path):
        with write_atomically(path) as partial_file:
            partial_file.write_text(
                json.dumps(document, indent=2, sort_keys=True) + "\n", encoding="utf-8"
            )
        return
    with wrap_errors(f"{path}: not JSON", "give another folder", catch=(OSError, ValueError)):
        earlier = json.loads(path.read_text(encoding="utf-8"))
    current = json.loads(json.dumps(document))
    if earlier != current:
        changed = sorted(name for name in current if earlier.get(name) != current[name])
        raise UsageError(
            f"{out} is a run of another {', '.join(changed)}; give another folder with --out"
        )
