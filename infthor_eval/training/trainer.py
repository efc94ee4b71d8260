"""Training by transformers' own Trainer: one device, DDP, or weights sharded over processes (FSDP2).

It is told what it cannot know: how sequences become batches, what a model is saved as, and that loss is taken by token.
"""

import json
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
import transformers
from safetensors.torch import load_model, save_model

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.loop import Progress
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.recipe import Recipe

__all__ = ["train_with_trainer"]

_WEIGHTS = "model.safetensors"


class _SequenceTrainer(transformers.Trainer):
    """Saves the weights of the network alone: tied ones stand in them once, as transformers' own models save them."""

    def _save(self, output_dir: str | None = None, state_dict: dict[str, Any] | None = None) -> None:
        folder = Path(output_dir or str(self.args.output_dir))
        folder.mkdir(parents=True, exist_ok=True)
        if state_dict is not None:  # put together out of shards
            super()._save(output_dir, state_dict)
            return
        save_model(self.accelerator.unwrap_model(self.model).model, str(folder / _WEIGHTS))

    def _load_from_checkpoint(self, resume_from_checkpoint: str, model: torch.nn.Module | None = None) -> None:
        if self.is_fsdp_enabled:
            super()._load_from_checkpoint(resume_from_checkpoint, model)
            return
        network = self.accelerator.unwrap_model(model or self.model)
        load_model(network.model, Path(resume_from_checkpoint) / _WEIGHTS)


class _Telling(transformers.TrainerCallback):
    """Tells of every step what our own loop tells."""

    def __init__(self, watcher: Callable[[Progress], None], n_tokens: float) -> None:
        self._watcher = watcher
        self._n_tokens = n_tokens  # of a step, on average
        self._began = time.perf_counter()

    def on_log(self, args: Any, state: Any, control: Any, logs: Any = None, **kwargs: Any) -> None:
        if not (state.is_world_process_zero and logs and "loss" in logs):
            return
        now = time.perf_counter()
        loss, rate, norm = (float(logs[name]) for name in ("loss", "learning_rate", "grad_norm"))
        speed = self._n_tokens / (now - self._began)
        self._began = now
        self._watcher(Progress(state.global_step, state.max_steps, loss, rate, norm, speed))


def train_with_trainer(
    network: SequenceModel,
    sequences: Sequence[TrainingSequence],
    collate: Callable[[list[Any]], dict[str, Any]],
    recipe: Recipe,
    out: Path,
    watcher: Callable[[Progress], None],
) -> None:
    """Train, going on from the last checkpoint in the folder if there is one.

    Args:
        network: what is trained.
        sequences: all of them; each process goes through its own.
        collate: makes a batch of sequences.
        recipe: how.
        out: folder of checkpoints.
        watcher: is told of every step, in the first process.

    Raises:
        UsageError: the processes cannot share the recipe's sequences evenly.
        DataError: the checkpoint that is gone on from cannot be read.
    """
    n_tokens = sum(sequence.n_tokens for sequence in sequences)
    trainer = _SequenceTrainer(
        model=network,
        args=_arguments(recipe, out, network),
        train_dataset=list(sequences),
        data_collator=collate,
        callbacks=[_Telling(watcher, recipe.sequences_per_step * n_tokens / len(sequences))],
    )
    trainer.remove_callback(transformers.trainer_callback.PrinterCallback)
    last = _last_whole(out)
    damaged = f"{last}: the checkpoint cannot be read"
    with wrap_errors(
        damaged, "remove it to go on from the one before", catch=(OSError, ValueError, KeyError), raise_as=DataError
    ):
        trainer.train(resume_from_checkpoint=last)


def _last_whole(out: Path) -> str | None:
    """The last checkpoint that was written to its end, of which the state is; a run may be killed while it writes one.

    Trainer would take the last folder, whatever is in it, and go on without the optimizer where that is missing.
    """
    for place in sorted(out.glob("checkpoint-*"), key=lambda path: int(path.name.rpartition("-")[2]), reverse=True):
        try:
            json.loads((place / "trainer_state.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        return str(place)
    return None


def _arguments(recipe: Recipe, out: Path, network: SequenceModel) -> transformers.TrainingArguments:
    optimizer, model_type = recipe.optimizer, recipe.model_args.get("dtype", "float32")
    arguments = transformers.TrainingArguments(
        output_dir=str(out),
        per_device_train_batch_size=1,
        num_train_epochs=recipe.epochs,
        max_steps=recipe.max_steps or -1,
        learning_rate=optimizer.lr,
        adam_beta1=optimizer.betas[0],
        adam_beta2=optimizer.betas[1],
        weight_decay=optimizer.weight_decay,
        max_grad_norm=optimizer.clip,
        lr_scheduler_type="linear",
        warmup_steps=optimizer.warmup_ratio,
        optim="adamw_torch",
        bf16=model_type == "bfloat16" and torch.cuda.is_available(),
        seed=recipe.seed,
        data_seed=recipe.seed,
        average_tokens_across_devices=True,
        ddp_find_unused_parameters=False,
        remove_unused_columns=False,
        logging_steps=1,
        logging_nan_inf_filter=False,
        save_steps=recipe.save_every,
        save_total_limit=2,
        report_to="none",
        disable_tqdm=True,
        use_cpu=not torch.cuda.is_available(),
        dataloader_pin_memory=False,
        **_sharding(recipe, network),
    )
    per_pass = arguments.world_size
    if recipe.sequences_per_step % per_pass:
        least = math.ceil(recipe.sequences_per_step / per_pass) * per_pass
        raise UsageError(
            f"sequences_per_step is {recipe.sequences_per_step} for {per_pass} processes; set it to {least}, say"
        )
    arguments.gradient_accumulation_steps = recipe.sequences_per_step // per_pass
    return arguments


def _sharding(recipe: Recipe, network: SequenceModel) -> dict[str, Any]:
    """Weights, gradients and optimizer in shards, layer by layer; accelerate does it on GPUs alone."""
    if not (recipe.parallel.shard and torch.distributed.is_initialized()):
        return {}
    layers = sorted(getattr(network.model, "_no_split_modules", None) or ())
    return {"fsdp": True, "fsdp_config": {"version": 2, "transformer_layer_cls_to_wrap": layers}}
