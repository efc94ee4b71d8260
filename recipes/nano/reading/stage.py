"""The second stage of the small model's training: the decoder learns to read and to act."""

import math
import random
from collections.abc import Iterator, Sequence
from typing import TypeVar

import torch
from torch import Tensor

from infthor_eval.training.batches import collate
from infthor_eval.training.encoding import TrainingSequence
from recipes.nano.action_sampler import ActionSampler
from recipes.nano.reading.asking import ReadingSequence
from recipes.nano.reading.branches import collate_branched
from recipes.nano.reading.frame_units import FrameUnits
from recipes.nano.reading.network import ReadingNetwork
from recipes.nano.reading.question_sampler import QuestionSampler
from recipes.nano.settings import NanoRecipe
from recipes.nano.steps import Stage, adamw

_BATCHES = 4  # that the sequences of a step are computed in
_Sequence = TypeVar("_Sequence", ReadingSequence, TrainingSequence)


def reading_stage(
    recipe: NanoRecipe,
    network: ReadingNetwork,
    labelled: FrameUnits,
    questions: QuestionSampler,
    actions: ActionSampler,
) -> Stage:
    """Return the stage, in which the tower is frozen but for the merger's last layer.

    Args:
        recipe: recipe of the training.
        network: the decoder with what the tower tells of all frames.
        labelled: what the frames show, which comes first.
        questions: draws questions.
        actions: draws histories and plans.
    """
    layers = [*network.decoder.layers.parameters()]
    in_layers = {*map(id, layers)}
    others = [one for one in network.trained_parameters() if id(one) not in in_layers]
    optimizer = adamw([(layers, recipe.layer_lr), (others, recipe.lr)], recipe.weight_decay)
    told = network.frames

    def compute(number: int) -> Tensor:
        rng = random.Random(f"{recipe.seed}/{number}")
        network.frames = labelled if number < recipe.reading.labelled * recipe.steps else told
        drawn = questions.draw(rng, number / recipe.steps)
        loss = _learn_to_read(network, drawn, recipe.event_weight)
        loss += _learn_to_act(network, actions.histories(rng), 1.0)
        return loss + _learn_to_act(
            network, actions.synthetic_plans(rng), recipe.acting.text_plans_weight
        )

    return Stage("reading", recipe.steps, network, (optimizer,), compute)


def _learn_to_read(
    network: ReadingNetwork, sequences: Sequence[ReadingSequence], event_weight: float
) -> Tensor:
    """Add the gradients of questions, and return their loss per token of answers."""
    n_tokens = sum(one.tokens.n_loss_tokens for one in sequences)
    n_frames = sum(of_frame is not None for one in sequences for of_frame in one.events)
    whole = torch.zeros(())
    for part in _parts(sequences, [one.tokens.n_tokens for one in sequences]):
        batch = collate_branched([one.tokens for one in part], network.family, pad_id=0)
        answers, events = network.losses(batch, [one.events for one in part])
        loss = answers / n_tokens
        (loss + event_weight * events / max(1, n_frames)).backward()
        whole += loss.detach()
    return whole


def _learn_to_act(
    network: ReadingNetwork, sequences: Sequence[TrainingSequence], weight: float
) -> Tensor:
    """Add the weighted gradients of actions, and return their weighted loss per token."""
    n_tokens = sum(one.n_loss_tokens for one in sequences)
    whole = torch.zeros(())
    for part in _parts(sequences, [one.n_tokens for one in sequences]):
        batch = collate(part, network.family, pad_id=0)
        loss = weight * network(**batch, num_items_in_batch=n_tokens)["loss"]
        loss.backward()
        whole += loss.detach()
    return whole


def _parts(sequences: Sequence[_Sequence], lengths: Sequence[int]) -> Iterator[list[_Sequence]]:
    """Yield sequences in batches of about one length.

    A question on one frame has 30 tokens, one behind a memory 300: most of a single batch would be
    padding.
    """
    order = sorted(range(len(sequences)), key=lengths.__getitem__)
    size = math.ceil(len(order) / _BATCHES)
    for first in range(0, len(order), size):
        yield [sequences[at] for at in order[first : first + size]]
