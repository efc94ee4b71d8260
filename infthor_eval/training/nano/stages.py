"""Training of the small model in three stages, from replayed sets to a loaded model."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import torch
from torch import Tensor

from infthor_eval.reasons import count_reasons
from infthor_eval.storage.digests import fingerprint
from infthor_eval.training.batches import collate, n_labels
from infthor_eval.training.checkpoints import Checkpoints
from infthor_eval.training.encoding import Encoder, TrainingSequence
from infthor_eval.training.nano.architecture import build_untrained, image_processor
from infthor_eval.training.nano.frame_dataset import read_frame_dataset
from infthor_eval.training.nano.network import NanoNetwork
from infthor_eval.training.nano.question_sampler import question_intro
from infthor_eval.training.nano.sampler import SequenceSampler, corpus_texts
from infthor_eval.training.nano.settings import NanoRecipe
from infthor_eval.training.nano.whitening import whiten_patches
from infthor_eval.training.network import decay_groups
from model_adapters.hf.loading.loaded import LoadedCheckpoint

__all__ = ["NanoProgress", "train_small_model"]

_WARM_UP = 50  # steps
_LOWEST = 0.05  # final learning rate as a share of the highest
_BETAS = (0.9, 0.98)
_CLIP = 1.0
_BATCHES = 4  # that the sequences of a step are computed in
_TEXT_STAGE_FRAMES = 16  # frames for the vision loss in each step of the text stage
_STEPS_PER_STATE = 100  # a state is written, from which a stopped training continues


@dataclass(frozen=True)
class NanoProgress:
    """A finished step.

    Attributes:
        stage: "vision", "text" or "joint".
        step: number of the step in the stage, from 1.
        n_steps: steps of the stage.
        loss: loss in nats: per frame in the vision stage, per token in the text stage, and in the
            joint stage the sum of the losses per token of answers, of actions, and of weighted
            synthetic plans.
    """

    stage: str
    step: int
    n_steps: int
    loss: float


def train_small_model(
    recipe: NanoRecipe,
    folders: Sequence[Path],
    states: Path,
    on_step: Callable[[NanoProgress], None],
    print_note: Callable[[str], None] = lambda _: None,
) -> LoadedCheckpoint:
    """Train the small model on replayed sets, from the last state if there is one.

    A training that was stopped and continued gives the weights of one that was not.

    Args:
        recipe: recipe of the training.
        folders: folders of the sets, with trajectories and questions.
        states: folder of the states.
        on_step: called after every step.
        print_note: called with a line for each reason for which items were skipped.

    Returns:
        The trained model with weights rounded to bfloat16.

    Raises:
        DataError: a set cannot be read, or has no data for one of the stages; or a state is damaged
            or cannot be written.
        UsageError: the states are of another recipe or other data.
    """
    torch.set_num_threads(recipe.threads)
    torch.manual_seed(recipe.seed)
    dataset = read_frame_dataset(folders, image_processor(recipe.vision.grid), recipe.vision.grid)
    loaded = build_untrained(recipe, corpus_texts(folders, dataset.types), [question_intro()])
    whiten_patches(loaded.model.model.visual, dataset.pixels, recipe.seed)
    network = NanoNetwork(loaded, dataset)
    sampler = SequenceSampler(Encoder(loaded), folders, dataset, recipe)
    for _, reason, n in count_reasons(("", skipped.reason) for skipped in sampler.skipped):
        print_note(f"{n} skipped: {reason}")
    about = {"recipe": fingerprint(msgspec.to_builtins(recipe)), "data": dataset.identity()}
    trainer = _StageTrainer(recipe, network, sampler, Checkpoints(states, about), on_step)
    network.train()
    trainer.run("vision", recipe.vision.steps, recipe.vision.lr, trainer.vision_step)
    network.cache_features()
    trainer.run("text", recipe.text_steps, recipe.lr, trainer.text_step)
    trainer.run("joint", recipe.joint_steps, recipe.lr, trainer.joint_step)
    network.eval()
    # Halves the file; no answer of the bundled model depends on the rounding.
    loaded.model.to(torch.bfloat16)
    return loaded


class _StageTrainer:
    """Steps of all stages, with one optimizer.

    Steps that the last state has already are not done again.
    """

    def __init__(
        self,
        recipe: NanoRecipe,
        network: NanoNetwork,
        sampler: SequenceSampler,
        checkpoints: Checkpoints,
        on_step: Callable[[NanoProgress], None],
    ) -> None:
        self._recipe = recipe
        self._network = network
        self._sampler = sampler
        self._on_step = on_step
        self._parameters = list(network.parameters())
        groups = decay_groups(self._parameters, recipe.weight_decay)
        self._optimizer = torch.optim.AdamW(groups, lr=recipe.lr, betas=_BETAS)
        self._checkpoints = checkpoints
        self._n_restored = checkpoints.restore(network, self._optimizer)
        self._n_before = 0  # steps of the stages before

    def run(
        self, stage: str, n_steps: int, lr: float, compute: Callable[[float], tuple[Tensor, Tensor]]
    ) -> None:
        """Run the steps of one stage with a linear warm-up and a cosine decay of the learning rate.

        Args:
            stage: name of the stage.
            n_steps: steps of the stage.
            lr: highest learning rate.
            compute: computes the loss of a step, and the part of it to report, by the share of the
                stage's steps that is done.
        """
        for number in range(max(0, self._n_restored - self._n_before), n_steps):
            self._sampler.begin_step(stage, number)
            warm_up = min(1.0, (number + 1) / _WARM_UP)
            decay = _LOWEST + (1 - _LOWEST) * 0.5 * (1 + math.cos(math.pi * number / n_steps))
            for group in self._optimizer.param_groups:
                group["lr"] = lr * warm_up * decay
            loss, reported = compute(number / n_steps)
            self._optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self._parameters, _CLIP)
            self._optimizer.step()
            n_done = self._n_before + number + 1
            if n_done % _STEPS_PER_STATE == 0:
                self._checkpoints.save(n_done, self._network, self._optimizer)
            self._on_step(NanoProgress(stage, number + 1, n_steps, reported.item()))
        self._n_before += n_steps

    def vision_step(self, _progress: float) -> tuple[Tensor, Tensor]:
        """Return the loss of what some frames show."""
        indices = self._sampler.frames(self._recipe.vision.frames_per_step)
        features = self._network.frame_features(indices)
        loss = self._naming_loss(features, indices) + self._network.state_loss(features, indices)
        return loss, loss.detach()

    def text_step(self, _progress: float) -> tuple[Tensor, Tensor]:
        """Return the loss of synthetic plans, plus that of some frames.

        The embeddings of names change in this stage; the loss of naming keeps them close to the
        features of the objects.
        """
        recipe = self._recipe
        indices = self._sampler.frames(_TEXT_STAGE_FRAMES)
        loss = self._token_loss(self._sampler.synthetic_plans(recipe.text_plans_per_step))
        naming_loss = self._naming_loss(self._network.frame_features(indices), indices)
        return loss + recipe.vision.weight * naming_loss, loss.detach()

    def joint_step(self, progress: float) -> tuple[Tensor, Tensor]:
        """Return the loss of questions, histories, synthetic plans, and of the questions' frames.

        Answers and actions have the same weight, though most tokens are actions.
        """
        recipe = self._recipe
        questions = self._sampler.questions(progress)
        answers = self._token_loss(questions)
        indices, features = self._network.frames_of(questions)
        histories = self._sampler.histories(
            recipe.windows_per_step, recipe.plans_per_step, recipe.single_plan_share
        )
        actions = self._token_loss(histories)
        text_plans = self._token_loss(
            self._sampler.synthetic_plans(recipe.joint_text_plans_per_step)
        )
        loss = answers + actions + recipe.text_plans_weight * text_plans
        return loss + recipe.vision.weight * self._naming_loss(features, indices), loss.detach()

    def _naming_loss(self, features: Tensor, indices: Sequence[int]) -> Tensor:
        return self._network.naming_loss(
            features, indices, self._sampler.spelling(self._network.n_spellings)
        )

    def _token_loss(self, sequences: Sequence[TrainingSequence]) -> Tensor:
        """Return the mean loss per token of sequences, in batches of about one length.

        A question on one frame has 40 tokens, one behind a memory 300: most of a single batch would
        be padding.
        """
        by_length = sorted(sequences, key=lambda sequence: sequence.n_tokens)
        size = math.ceil(len(by_length) / _BATCHES)
        parts = (by_length[at : at + size] for at in range(0, len(by_length), size))
        batches = [collate(part, self._network.family, pad_id=0) for part in parts]
        n_tokens = sum(map(n_labels, batches))
        losses = [self._network(**batch, num_items_in_batch=n_tokens)["loss"] for batch in batches]
        return torch.stack(losses).sum()
