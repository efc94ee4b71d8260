"""Training on one process or many, with sequences over data groups and split within them.

The loss of a step is the mean over all tokens with loss of all its sequences, so the number of
processes changes nothing but rounding.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
import torch.distributed as dist
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.storage.digests import digest, seed_of
from infthor_eval.training.batches import Batch, collate, n_labels
from infthor_eval.training.checkpoints import Checkpoints
from infthor_eval.training.context_parallel import context_parallel
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.ranks import Ranks, sum_gradients
from infthor_eval.training.schedule import LoopSettings

_Loss = Callable[[Batch, int], Tensor]


@dataclass(frozen=True)
class Progress:
    """A finished step.

    Attributes:
        step: number of the step, from 1.
        n_steps: steps of the run.
        loss: mean over the tokens with loss, in nats.
        learning_rate: learning rate of the step.
        gradient_norm: norm of the gradient before clipping.
        tokens_per_second: speed over all sequences of the step, frames expanded.
    """

    step: int
    n_steps: int
    loss: float
    learning_rate: float
    gradient_norm: float
    tokens_per_second: float


class Loop:
    """A training run.

    Args:
        model: the model, the same on every process.
        pad_id: padding token.
        sequences: all sequences, on every process.
        settings: settings of the run.
        folder: folder of its states.
        ranks: position of this process among all.
        on_step: called after every step, on the first process.
    """

    def __init__(
        self,
        model: SequenceModel,
        pad_id: int,
        sequences: Sequence[TrainingSequence],
        settings: LoopSettings,
        folder: Path,
        *,
        ranks: Ranks | None = None,
        on_step: Callable[[Progress], None] | None = None,
    ) -> None:
        if not sequences:
            raise UsageError("there are no sequences to train on; give other data")
        self._model = model
        self._pad_id = pad_id
        self._sequences = sequences
        self._settings = settings
        self._ranks = ranks or Ranks()
        self._on_step = on_step
        self._n_steps = settings.n_steps(len(sequences))
        self._trained = [parameter for parameter in model.parameters() if parameter.requires_grad]
        if not self._trained:
            raise UsageError("nothing is left to train; freeze fewer parts")
        self._optimizer = _optimizer(self._trained, settings)
        self._checkpoints = Checkpoints(folder, self._run_settings())

    def run(self) -> None:
        """Train to the end, from the folder's last state if there is one.

        All processes have to call this, with the same folder. With an unchanged number of
        processes, the final weights are bit for bit those of a run that was never interrupted.
        """
        n_done = self._checkpoints.restore(self._model.model, self._optimizer)
        self._broadcast_weights()
        self._model.train()
        with self._losses() as loss:
            for step in range(n_done, self._n_steps):
                progress = self._step(step, loss)
                if self._ranks.rank == 0 and self._on_step is not None:
                    self._on_step(progress)
                if self._is_save_step(step + 1):
                    self._save(step + 1)
        self._model.eval()

    def _step(self, step: int, loss: _Loss) -> Progress:
        start = time.perf_counter()
        # A seed per step, so that a state need not contain the generator.
        torch.manual_seed(
            seed_of(f"{self._settings.seed} step {step} rank {self._ranks.rank}") % 2**63
        )
        batches = self._batches(step)
        n_items, n_tokens = self._count_tokens(batches)
        total = torch.zeros((), device=self._model.device)
        for batch in batches:
            share = loss(batch, n_items)
            share.backward()
            total += share.detach()
        if self._ranks.n_ranks > 1:
            sum_gradients(self._trained)
            dist.all_reduce(total)
        norm = clip_grad_norm_(self._trained, self._settings.clip)
        if not norm.isfinite():
            raise ModelError(
                f"step {step + 1}: the gradient is not finite; lower the learning rate, or train "
                "in bfloat16"
            )
        learning_rate = self._settings.learning_rate_of(step, self._n_steps)
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate
        self._optimizer.step()
        self._optimizer.zero_grad()
        seconds = time.perf_counter() - start
        return Progress(
            step + 1, self._n_steps, total.item(), learning_rate, norm.item(), n_tokens / seconds
        )

    def _batches(self, step: int) -> list[Batch]:
        """Return this process's sequences of a step, one per batch, so that nothing is padded."""
        numbers = self._settings.sequences_of(step, len(self._sequences))
        own = numbers[self._ranks.data_rank :: self._ranks.n_data]
        return [
            collate([self._sequences[number]], self._model.family, self._pad_id) for number in own
        ]

    def _count_tokens(self, batches: Sequence[Batch]) -> tuple[int, int]:
        """Return the labels and tokens of a step's sequences on all processes."""
        counts = torch.zeros(2, dtype=torch.int64, device=self._model.device)
        if self._ranks.context_rank == 0:
            counts += counts.new_tensor(
                [sum(map(n_labels, batches)), sum(b["input_ids"].numel() for b in batches)]
            )
        if self._ranks.n_ranks > 1:
            dist.all_reduce(counts)
        n_items, n_tokens = counts.tolist()
        return n_items, n_tokens

    @contextmanager
    def _losses(self) -> Iterator[_Loss]:
        if self._ranks.context_group is None:
            yield lambda batch, n_items: self._model(**batch, num_items_in_batch=n_items)["loss"]
            return
        with context_parallel(self._model, self._ranks.context_group) as parallel:
            yield parallel.loss

    def _broadcast_weights(self) -> None:
        """Give all processes the first one's weights, because randomly initialised ones differ."""
        if self._ranks.n_ranks > 1:
            for parameter in self._model.parameters():
                dist.broadcast(parameter.data, 0)

    def _is_save_step(self, n_done: int) -> bool:
        every = self._settings.save_every
        return n_done == self._n_steps or (every is not None and n_done % every == 0)

    def _save(self, n_done: int) -> None:
        if self._ranks.rank == 0:
            self._checkpoints.save(n_done, self._model.model, self._optimizer)
        if self._ranks.n_ranks > 1:
            dist.barrier()

    def _run_settings(self) -> dict[str, object]:
        """Return the settings that identify a run, without saving and number of processes."""
        settings = asdict(self._settings)
        del settings["save_every"]
        names = digest(
            "\n".join(f"{sequence.name} {sequence.n_tokens}" for sequence in self._sequences)
        )
        n_trained = sum(parameter.numel() for parameter in self._trained)
        return {
            **settings,
            "betas": list(self._settings.betas),
            "sequences": names,
            "n_trained": n_trained,
        }


def _optimizer(
    parameters: Sequence[torch.nn.Parameter], settings: LoopSettings
) -> torch.optim.AdamW:
    decay = settings.weight_decay
    return torch.optim.AdamW(
        parameters, lr=settings.learning_rate, betas=settings.betas, weight_decay=decay
    )
