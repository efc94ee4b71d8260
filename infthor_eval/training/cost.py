"""Estimates of the work and memory of a training run; docs/training.md has the formulae."""

from dataclasses import dataclass
from typing import Any

import torch
from PIL import Image
from torch.utils.flop_counter import FlopCounterMode

from infthor_eval.training.data import TrainingData
from infthor_eval.training.network import SequenceModel, parameters_by_part
from infthor_eval.training.recipe import Recipe

_SAMPLE = (300, 300)  # width and height of frames in the published data
_MOMENTS = 2  # moments of AdamW per weight
_LORA_SHARE = 0.02  # approximate size of adapters of rank 16, relative to the decoder's weights


@dataclass(frozen=True)
class TrainingCost:
    """Work of a run, and memory of one of its processes in bytes.

    Attributes:
        flop: floating point operations of all steps.
        weights: memory of the weights.
        gradients: memory of the gradients of trained weights.
        optimizer: memory of both moments.
        activations: memory of the activations that are kept for the gradient of the longest
            sequence.
    """

    flop: float
    weights: float
    gradients: float
    optimizer: float
    activations: float

    @property
    def memory(self) -> float:
        """Total memory in bytes."""
        return self.weights + self.gradients + self.optimizer + self.activations

    def hours(self, tflops: float) -> float:
        """Return the hours of the run at this speed of all processes together, in TFLOP/s."""
        return self.flop / (tflops * 1e12) / 3600


def estimate_cost(
    recipe: Recipe, network: SequenceModel, data: TrainingData, n_processes: int
) -> TrainingCost:
    """Estimate the work and memory of a run; the network must have its frozen parts."""
    parts = parameters_by_part(network)
    total = sum(parameter.nbytes for parameter in network.parameters())
    trained = sum(parameter.nbytes for parameter in network.parameters() if parameter.requires_grad)
    if recipe.lora is not None:
        trained = int(_LORA_SHARE * sum(parameter.nbytes for parameter in parts["decoder"]))
    shards = n_processes if recipe.parallel.shard else 1
    longest = max(sequence.n_tokens for sequence in data.sequences)
    passes = float(recipe.epochs)
    if recipe.max_steps is not None:
        passes = min(passes, recipe.max_steps * recipe.sequences_per_step / len(data.sequences))
    return TrainingCost(
        flop=passes * _flop(recipe, network, data, parts),
        weights=total / shards,
        gradients=trained / shards,
        optimizer=_MOMENTS * trained / shards,
        activations=_activations(recipe, network, longest / recipe.parallel.context),
    )


def _flop(
    recipe: Recipe, network: SequenceModel, data: TrainingData, parts: dict[str, Any]
) -> float:
    """Return the operations of an epoch: forward, backward to layers and weights, recomputation."""
    config = network.decoder.config
    n_weights = sum(parameter.numel() for parameter in parts["decoder"])
    width = config.num_attention_heads * getattr(
        config, "head_dim", config.hidden_size // config.num_attention_heads
    )
    lengths = [sequence.n_tokens for sequence in data.sequences]
    forward = sum(
        2 * n_weights * n_tokens + 2 * config.num_hidden_layers * width * n_tokens**2
        for n_tokens in lengths
    )
    trains_decoder = recipe.lora is None and any(
        parameter.requires_grad for parameter in parts["decoder"]
    )
    times = 2 + int(trains_decoder) + int(recipe.gradient_checkpointing)
    n_frames = sum(len(sequence.frames) for sequence in data.sequences)
    return times * forward + n_frames * _flop_of_frame(network) * (
        3 if network.trains_vision else 1
    )


@torch.no_grad()
def _flop_of_frame(network: SequenceModel) -> float:
    """Count the operations of the vision tower on a blank frame."""
    counter = FlopCounterMode(display=False)
    with counter:
        network.family.features([Image.new("RGB", _SAMPLE)])
    return float(counter.get_total_flops())


def _activations(recipe: Recipe, network: SequenceModel, n_tokens: float) -> float:
    """Return a sequence's activations: each layer's input and one layer's own, or all layers'."""
    config = network.decoder.config
    size = network.model.dtype.itemsize
    heads = config.num_key_value_heads / config.num_attention_heads
    # Norm, queries, keys, values, attention, projection, norm; gate, up, product, activation; and
    # the residual sums.
    within = (6 + 2 * heads) * config.hidden_size + 4 * config.intermediate_size
    layers = config.num_hidden_layers
    per_token = (
        layers * config.hidden_size + within if recipe.gradient_checkpointing else layers * within
    )
    return per_token * n_tokens * size
