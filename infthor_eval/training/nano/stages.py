"""From sets to a small model that has learned to see, to answer and to act."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from infthor_eval.reasons import count_reasons
from infthor_eval.training.batches import collate
from infthor_eval.training.encoding import Encoder, TrainingSequence
from infthor_eval.training.nano.architecture import build_untrained, image_processor
from infthor_eval.training.nano.frame_dataset import read_frame_dataset
from infthor_eval.training.nano.network import NanoNetwork
from infthor_eval.training.nano.sampler import SequenceSampler, corpus_texts, question_intro
from infthor_eval.training.nano.settings import NanoRecipe
from infthor_eval.training.network import decay_groups
from model_adapters.hf.loaded import Loaded

__all__ = ["NanoProgress", "train_small_model"]

_WARM_UP = 50  # steps
_LOWEST = 0.05  # of the learning rate, in the end
_BETAS = (0.9, 0.98)
_CLIP = 1.0
_FRAMES_BESIDE = 16  # of which it is asked what is to be seen, while it reads


@dataclass(frozen=True)
class NanoProgress:
    """A step that is done.

    Attributes:
        part: "see", "read" or "tell".
        step: its number in the part, from 1 on.
        n_steps: of the part.
        loss: of what is seen, per frame; of what is read, per token; of answers and of actions, each per token,
            together. In nats.
    """

    part: str
    step: int
    n_steps: int
    loss: float


def train_small_model(
    recipe: NanoRecipe,
    folders: Sequence[Path],
    watcher: Callable[[NanoProgress], None],
    say: Callable[[str], None] = lambda _: None,
) -> Loaded:
    """Train the small model on replayed sets.

    Args:
        recipe: how.
        folders: of the sets, with trajectories and questions.
        watcher: is told of every step.
        say: is told what no sequence could be made of.

    Returns:
        The model, to be exported; its weights are rounded to bfloat16.

    Raises:
        DataError: a set cannot be read, or there is nothing in them to learn from.
    """
    torch.set_num_threads(recipe.threads)
    torch.manual_seed(recipe.seed)
    dataset = read_frame_dataset(folders, image_processor())
    loaded = build_untrained(recipe, corpus_texts(folders, dataset.types), [question_intro()])
    network = NanoNetwork(loaded, dataset)
    sampler = SequenceSampler(Encoder(loaded), folders, dataset, window_tokens=recipe.window_tokens, seed=recipe.seed)
    for _, reason, n in count_reasons(("", item.reason) for item in sampler.left_out):
        say(f"{n} left out: {reason}")
    trainer = _StageTrainer(recipe, network, sampler)
    network.train()
    trainer.run("see", recipe.seeing_steps, trainer.see, watcher)
    network.cache_features()
    trainer.run("read", recipe.reading_steps, trainer.read, watcher)
    trainer.run("tell", recipe.telling_steps, trainer.tell, watcher)
    network.eval()
    loaded.model.to(torch.bfloat16)  # half the file, and no answer hangs on what is rounded off
    return loaded


class _StageTrainer:
    """The steps of all parts."""

    def __init__(self, recipe: NanoRecipe, network: NanoNetwork, sampler: SequenceSampler) -> None:
        self._recipe = recipe
        self._network = network
        self._lessons = sampler
        self._trained = list(network.parameters())
        groups = decay_groups(self._trained, recipe.weight_decay)
        self._optimizer = torch.optim.AdamW(groups, lr=recipe.lr, betas=_BETAS)

    def run(
        self,
        part: str,
        n_steps: int,
        step: Callable[[], tuple[Tensor, Tensor]],
        watcher: Callable[[NanoProgress], None],
    ) -> None:
        """Make the steps of one part, at a learning rate that rises, and falls along a cosine."""
        for number in range(n_steps):
            rise = min(1.0, (number + 1) / _WARM_UP)
            fall = _LOWEST + (1 - _LOWEST) * 0.5 * (1 + math.cos(math.pi * number / n_steps))
            for group in self._optimizer.param_groups:
                group["lr"] = self._recipe.lr * rise * fall
            loss, told = step()
            self._optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self._trained, _CLIP)
            self._optimizer.step()
            watcher(NanoProgress(part, number + 1, n_steps, told.item()))

    def see(self) -> tuple[Tensor, Tensor]:
        """What is in some frames."""
        places = self._lessons.frames(self._recipe.frames_per_step)
        loss = self._seen(self._network.frame_features(places), places)
        return loss, loss.detach()

    def read(self) -> tuple[Tensor, Tensor]:
        """Orders; and some frames, as the names' embeddings learn here and are not to leave what they look like."""
        recipe, places = self._recipe, self._lessons.frames(_FRAMES_BESIDE)
        loss = self._told(self._lessons.orders(recipe.orders_read))
        return loss + recipe.seeing_weight * self._seen(self._network.frame_features(places), places), loss.detach()

    def tell(self) -> tuple[Tensor, Tensor]:
        """Answers and actions, which count alike, though histories have most of the tokens; and orders beside them.

        What is in the questions' frames is asked too, as in reading.
        """
        recipe = self._recipe
        answered = self._told(self._lessons.questions(recipe.questions_per_step, recipe.made_up))
        places, features = self._network.last_frames
        acted = self._told(self._lessons.histories(recipe.windows_per_step, recipe.plans_per_step, recipe.alone))
        ordered = self._told(self._lessons.orders(recipe.orders_per_step))
        loss = answered + acted + recipe.orders_weight * ordered
        return loss + recipe.seeing_weight * self._seen(features, places), loss.detach()

    def _seen(self, features: Tensor, places: Sequence[int]) -> Tensor:
        return self._network.vision_loss(features, places, self._lessons.way(self._network.n_spellings))

    def _told(self, sequences: Sequence[TrainingSequence]) -> Tensor:
        """Loss of some sequences, by token."""
        batch = collate(sequences, self._network.family, pad_id=0)
        loss: Tensor = self._network(**batch)["loss"]
        return loss
