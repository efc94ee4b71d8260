"""Training on one process or many, with sequences shared out over data groups and cut within them.

The loss of a step is the mean over all tokens that loss is taken on, of all its sequences: how they are shared out
changes nothing but rounding.
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
from infthor_eval.formats.digests import digest, seed_of
from infthor_eval.training.batches import Batch, collate, n_labels
from infthor_eval.training.checkpoints import Checkpoints
from infthor_eval.training.context_parallel import context_parallel
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.gradients import sum_gradients
from infthor_eval.training.network import SequenceModel, decay_groups
from infthor_eval.training.ranks import Ranks
from infthor_eval.training.schedule import LoopSettings

__all__ = ["Loop", "LoopSettings", "Progress"]

_Loss = Callable[[Batch, int], Tensor]


@dataclass(frozen=True)
class Progress:
    """A step that is done.

    Attributes:
        step: its number, from 1 on.
        n_steps: of the run.
        loss: mean over the tokens that loss is taken on, in nats.
        learning_rate: of the step.
        gradient_norm: before clipping.
        tokens_per_second: of all sequences of the step, frames expanded.
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
        model: the same on every process.
        pad_id: the tokenizer's padding.
        sequences: all of them, on every process.
        settings: of the run.
        folder: of its checkpoints.
        ranks: this process's place among all.
        report: is told of every step, on the first process.

    Raises:
        UsageError: there are no sequences, or nothing to train.
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
        report: Callable[[Progress], None] | None = None,
    ) -> None:
        if not sequences:
            raise UsageError("there is no sequence to train on; give data of which at least one can be made")
        self._model = model
        self._pad_id = pad_id
        self._sequences = sequences
        self._settings = settings
        self._ranks = ranks or Ranks()
        self._report = report
        self._n_steps = settings.n_steps(len(sequences))
        self._trained = [parameter for parameter in model.parameters() if parameter.requires_grad]
        if not self._trained:
            raise UsageError("nothing is left to train; freeze fewer parts")
        self._optimizer = _optimizer(self._trained, settings)
        self._checkpoints = Checkpoints(folder, self._about())

    def run(self) -> None:
        """Train to the end, from the folder's checkpoint on if there is one.

        All processes have to call it, and to see the same folder. On as many processes as before, the weights at the
        end are bit for bit those of a run that was never interrupted.

        Raises:
            DataError: a frame cannot be read, a sequence has no token to take loss on, or a checkpoint is damaged or
                cannot be written.
            ModelError: the gradient is not finite, or the model cannot be trained in this way.
            UsageError: the checkpoint is of another run.
        """
        done = self._checkpoints.restore(self._model.model, self._optimizer)
        self._share_weights()
        self._model.train()
        with self._losses() as loss:
            for step in range(done, self._n_steps):
                progress = self._step(step, loss)
                if self._ranks.rank == 0 and self._report is not None:
                    self._report(progress)
                if self._is_saved(step + 1):
                    self._save(step + 1)
        self._model.eval()

    def _step(self, step: int, loss: _Loss) -> Progress:
        began = time.perf_counter()
        # So dropout needs no state of its own in a checkpoint.
        torch.manual_seed(seed_of(f"{self._settings.seed} step {step} rank {self._ranks.rank}") % 2**63)
        batches = self._batches(step)
        n_items, n_tokens = self._counted(batches)
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
                f"step {step + 1}: the gradient is not finite; lower the learning rate, or train in bfloat16"
            )
        learning_rate = self._settings.learning_rate_of(step, self._n_steps)
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate
        self._optimizer.step()
        self._optimizer.zero_grad()
        seconds = time.perf_counter() - began
        return Progress(step + 1, self._n_steps, total.item(), learning_rate, norm.item(), n_tokens / seconds)

    def _batches(self, step: int) -> list[Batch]:
        """This process's sequences of a step, one a batch: so nothing is padded."""
        chosen = self._settings.sequences_of(step, len(self._sequences))
        own = chosen[self._ranks.data_rank :: self._ranks.n_data]
        return [collate([self._sequences[number]], self._model.family, self._pad_id) for number in own]

    def _counted(self, batches: Sequence[Batch]) -> tuple[int, int]:
        """Labels and tokens of a step's sequences, those of other processes too."""
        counts = torch.zeros(2, dtype=torch.int64, device=self._model.device)
        if self._ranks.context_rank == 0:
            counts += counts.new_tensor([sum(map(n_labels, batches)), sum(b["input_ids"].numel() for b in batches)])
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

    def _share_weights(self) -> None:
        """The first process's weights for all: what is initialised at random would differ."""
        if self._ranks.n_ranks > 1:
            for parameter in self._model.parameters():
                dist.broadcast(parameter.data, 0)

    def _is_saved(self, n_done: int) -> bool:
        every = self._settings.save_every
        return n_done == self._n_steps or (every is not None and n_done % every == 0)

    def _save(self, n_done: int) -> None:
        if self._ranks.rank == 0:
            self._checkpoints.save(n_done, self._model.model, self._optimizer)
        if self._ranks.n_ranks > 1:
            dist.barrier()

    def _about(self) -> dict[str, object]:
        """What makes a run the same; how often it is saved, and on how many processes it runs, is no part of it."""
        settings = asdict(self._settings)
        del settings["save_every"]
        names = digest("\n".join(f"{sequence.name} {sequence.n_tokens}" for sequence in self._sequences))
        n_trained = sum(parameter.numel() for parameter in self._trained)
        return {**settings, "betas": list(self._settings.betas), "sequences": names, "n_trained": n_trained}


def _optimizer(parameters: Sequence[torch.nn.Parameter], settings: LoopSettings) -> torch.optim.AdamW:
    groups = decay_groups(parameters, settings.weight_decay)
    return torch.optim.AdamW(groups, lr=settings.learning_rate, betas=settings.betas)
