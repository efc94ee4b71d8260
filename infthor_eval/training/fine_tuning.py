"""A training run: from a recipe and sets to a checkpoint that its family's adapter loads.

With transformers' Trainer: one device, DDP, or weights sharded over processes (FSDP2). The Trainer
is given what it does not know: batches of sequences, the format of saved weights, and a loss per
token.
"""

import json
import math
import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

import msgspec
import torch
import torch.distributed as dist
import transformers
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_model, save_model
from transformers.trainer_pt_utils import safe_globals

from infthor_eval.errors import UsageError, in_one_line, wrap_errors
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import hold_folder, is_written, write_atomically
from infthor_eval.terminal import print_error
from infthor_eval.training.batches import collate
from infthor_eval.training.data import TrainingData, read_training_data
from infthor_eval.training.encoding import Encoder, TrainingSequence
from infthor_eval.training.export import export, gather_weights
from infthor_eval.training.loop import Loop, LoopSettings, Progress
from infthor_eval.training.network import SequenceModel, freeze
from infthor_eval.training.ranks import assign_ranks
from infthor_eval.training.recipe import Lora, Recipe
from infthor_eval.training.schedule import linear_share
from infthor_eval.training.starting_model import load_starting_model
from model_adapters.hf.loading.loaded import LoadedCheckpoint

_DESCRIPTION = "training.json"
_STATES = "states"
_CHECKPOINT = "checkpoint"
StepCallback = Callable[[Progress], None]
_WEIGHTS = "model.safetensors"
_STATE = "trainer_state.json"


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
        adapters = _add_adapters(network, run.recipe.lora) if run.recipe.lora is not None else None
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
        _train_with_trainer(
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


def _add_adapters(network: SequenceModel, settings: Lora) -> Any:
    """Add adapters to the decoder's linear layers, freeze the rest, and return peft's model.

    Raises:
        UsageError: peft is not installed, or the decoder has none of the target layers.
    """
    try:
        import peft
    except ImportError as error:
        raise UsageError(
            "a recipe with lora needs peft; pip install 'infthor-eval[train]'"
        ) from error
    in_decoder = {id(module) for module in network.decoder.modules()}
    names = [
        name
        for name, module in network.model.named_modules()
        if id(module) in in_decoder and name.rpartition(".")[2] in settings.targets
    ]
    config = peft.LoraConfig(
        r=settings.rank,
        lora_alpha=settings.alpha,
        lora_dropout=settings.dropout,
        target_modules=names,
    )
    problem = f"lora.targets {', '.join(settings.targets)}: the decoder has no such layers"
    with wrap_errors(
        problem, "name some of its linear layers", catch=ValueError, raise_as=UsageError
    ):
        return peft.LoraModel(network.model, {"default": config}, "default")


class _SequenceTrainer(transformers.Trainer):
    """Saves the transformers model's weights only, with tied ones once, as transformers does.

    Weight decay and schedule are those of the published trainer: all weights decay, and
    `linear_share`.
    """

    lr_scheduler: Any

    def get_decay_parameter_names(self, model: torch.nn.Module) -> list[str]:
        return [name for name, _ in model.named_parameters()]

    def create_scheduler(self, num_training_steps: int, optimizer: Any = None) -> Any:
        if self.lr_scheduler is None:
            warmup_ratio = float(self.args.warmup_steps)

            def share(step: int) -> float:
                return linear_share(step, num_training_steps, warmup_ratio)

            self.lr_scheduler = torch.optim.lr_scheduler.LambdaLR(
                optimizer or cast(Any, self.optimizer), share
            )
        return self.lr_scheduler

    def _save(
        self, output_dir: str | None = None, state_dict: dict[str, Any] | None = None
    ) -> None:
        folder = Path(output_dir or str(self.args.output_dir))
        folder.mkdir(parents=True, exist_ok=True)
        if state_dict is not None:  # gathered from shards
            super()._save(output_dir, state_dict)
        else:
            save_model(self.accelerator.unwrap_model(self.model).model, str(folder / _WEIGHTS))

    def _save_checkpoint(self, model: torch.nn.Module, trial: Any) -> None:
        # Of torch, RuntimeError; of safetensors, its own.
        failures = (OSError, RuntimeError, SafetensorError)
        hint = "make room there and run the same command again, which resumes from the one before"
        problem = f"{self.args.output_dir}: a checkpoint cannot be written"
        with wrap_errors(problem, hint, catch=failures):
            super()._save_checkpoint(model, trial)

    def _load_from_checkpoint(
        self, resume_from_checkpoint: str, model: torch.nn.Module | None = None
    ) -> None:
        if self.is_fsdp_enabled:
            super()._load_from_checkpoint(resume_from_checkpoint, model)
        else:
            network = self.accelerator.unwrap_model(model or self.model)
            load_model(network.model, Path(resume_from_checkpoint) / _WEIGHTS)


class _ReportSteps(transformers.TrainerCallback):
    """Reports every step in the form of our own loop."""

    def __init__(self, on_step: Callable[[Progress], None], tokens_per_step: float) -> None:
        self._report = on_step
        self._tokens_per_step = tokens_per_step
        self._start = time.perf_counter()

    def on_log(self, args: Any, state: Any, control: Any, logs: Any = None, **kwargs: Any) -> None:
        if not (state.is_world_process_zero and logs and "loss" in logs):
            return
        now = time.perf_counter()
        speed = self._tokens_per_step / (now - self._start)
        self._start = now
        loss = float(logs["loss"])
        rate = float(logs["learning_rate"])
        norm = float(logs["grad_norm"])
        self._report(Progress(state.global_step, state.max_steps, loss, rate, norm, speed))


def _train_with_trainer(
    network: SequenceModel,
    sequences: Sequence[TrainingSequence],
    collate: Callable[[list[Any]], dict[str, Any]],
    recipe: Recipe,
    out: Path,
    on_step: Callable[[Progress], None],
) -> None:
    """Train, resuming from the last checkpoint in the folder if there is one.

    Args:
        network: the network.
        sequences: all sequences; each process uses its own share.
        collate: combines sequences to a batch.
        recipe: recipe of the run.
        out: folder of the checkpoints.
        on_step: called after every step, in the first process.

    Raises:
        UsageError: the sequences of a step cannot be divided evenly among the processes.
        DataError: the last checkpoint cannot be read, or a new one cannot be written.
    """
    n_tokens = sum(sequence.n_tokens for sequence in sequences)
    trainer = _SequenceTrainer(
        model=network,
        args=_arguments(recipe, out, network),
        train_dataset=list(sequences),
        data_collator=collate,
        callbacks=[_ReportSteps(on_step, recipe.sequences_per_step * n_tokens / len(sequences))],
    )
    trainer.remove_callback(transformers.trainer_callback.PrinterCallback)
    last = _last_whole_checkpoint(out)
    problem = f"{last}: the checkpoint cannot be read"
    hint = "remove it to resume from the one before"
    with wrap_errors(problem, hint, catch=(OSError, ValueError, KeyError)):
        trainer.train(resume_from_checkpoint=last)


def _last_whole_checkpoint(out: Path) -> str | None:
    """Return the last checkpoint that can be read, and remove later ones.

    A run may be killed while writing one, and a disk may lose a part of one. The Trainer itself
    would use the last folder, whatever it contains, and continue without the optimizer if that is
    missing. The state file is the last to be written.
    """
    for folder in sorted(
        out.glob("checkpoint-*"), key=lambda path: int(path.name.rpartition("-")[2]), reverse=True
    ):
        try:
            _check_files(folder)
        except Exception as error:  # noqa: BLE001 - whatever the readers raise on a damaged file
            if (folder / _STATE).exists():  # else it was not written completely
                print_error(f"{folder}: cannot be read ({in_one_line(error)}); left out")
            # With all that is in it: parts of weights have a new name each time.
            shutil.rmtree(folder, ignore_errors=True)  # another process of the run may, too
            continue
        return str(folder)
    return None


def _check_files(folder: Path) -> None:
    """Read the files of a checkpoint as the Trainer will: no code in them is run."""
    _ = transformers.TrainerState.load_from_json(str(folder / _STATE)).global_step + 1
    for path in folder.iterdir():
        if path.suffix == ".safetensors":
            with safe_open(path, "pt"):
                pass
        elif path.suffix in (".pt", ".pth"):
            with safe_globals():
                torch.load(path, map_location="cpu", weights_only=True)


def _arguments(recipe: Recipe, out: Path, network: SequenceModel) -> transformers.TrainingArguments:
    optimizer = recipe.optimizer
    model_type = recipe.model_args.get("dtype", "float32")
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
    n_processes = arguments.world_size
    if recipe.sequences_per_step % n_processes:
        least = math.ceil(recipe.sequences_per_step / n_processes) * n_processes
        raise UsageError(
            f"sequences_per_step={recipe.sequences_per_step} is not a multiple of the "
            f"{n_processes} processes; set it to {least}"
        )
    arguments.gradient_accumulation_steps = recipe.sequences_per_step // n_processes
    return arguments


def _sharding(recipe: Recipe, network: SequenceModel) -> dict[str, Any]:
    """Return the settings that shard weights, gradients and optimizer by layers, which accelerate
    does on GPUs only."""
    if not (recipe.parallel.shard and torch.distributed.is_initialized()):
        return {}
    layers = sorted(getattr(network.model, "_no_split_modules", None) or ())
    return {"fsdp": True, "fsdp_config": {"version": 2, "transformer_layer_cls_to_wrap": layers}}
