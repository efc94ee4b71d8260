"""The first stage of the small model's training: the tower learns to see."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from recipes.nano.seeing.muon import Muon
from recipes.nano.seeing.network import SeeingNetwork
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seeing.view_dataset import ViewBatch, ViewDataset
from recipes.nano.settings import NanoRecipe
from recipes.nano.steps import Stage, adamw

_WHITENED_FRAMES = 600
_SHIFT = 2.0  # logits by which units are raised when the tower is trained
_RAISED = 1.0  # logits by which those of what is shown are once more, when the decoder is
_SMOOTHING = 1e-3  # of the patches' mean variance, added to each; components of less are noise
_SCALE = 0.5  # standard deviation of the first layer's outputs


def seeing_stage(recipe: NanoRecipe, network: SeeingNetwork, views: ViewDataset) -> Stage:
    """Return the stage, with the tower's first layer set to the views' principal components."""
    vision = recipe.vision
    rng = np.random.default_rng(recipe.seed)
    first = views.random_frames(min(_WHITENED_FRAMES, len(views)), rng)
    whiten_patches(network.tower, network.inputs(first), recipe.seed)
    matrices = [parameter for parameter in network.tower.blocks.parameters() if parameter.ndim == 2]
    chosen = {*map(id, matrices), *map(id, network.tower.merger.mlp[2].parameters())}
    others = [parameter for parameter in network.parameters() if id(parameter) not in chosen]
    optimizers = (
        Muon(matrices, lr=vision.matrix_lr, weight_decay=recipe.weight_decay),
        adamw([(others, vision.lr)], recipe.weight_decay),
    )

    def compute(number: int) -> Tensor:
        loss = network.loss(_draw(recipe, views, number))
        loss.backward()
        return loss.detach()

    return Stage("vision", vision.steps, network, optimizers, compute)


def _draw(recipe: NanoRecipe, views: ViewDataset, number: int) -> ViewBatch:
    """Return the pictures of a step: crops alone at first, then also frames."""
    vision = recipe.vision
    rng = np.random.default_rng([recipe.seed, number])
    is_crops = number < vision.crops * vision.steps or rng.random() < vision.mixed
    if is_crops:
        return views.crops(max(1, vision.patches_per_step // views.crop_patches), rng)
    return views.random_frames(max(1, vision.patches_per_step // views.frame_patches), rng)


def lower_thresholds(tower: Any, units: Units) -> None:
    """Let units hand on what they are half sure of: a unit is on from above a half at first, and
    rare things seldom get there."""
    with torch.no_grad():
        tower.merger.mlp[0].bias[: len(units)] += _SHIFT


def raise_units(tower: Any, units: Units) -> None:
    """Let the decoder take more for shown than when it was trained.

    What is asked of twins is smaller than most of what it learned from.
    """
    n_types = len(units.types)
    shown = slice(Role.SHOWN * n_types, (Role.SHOWN + 1) * n_types)
    with torch.no_grad():
        tower.merger.mlp[0].bias[shown] += _RAISED


def whiten_patches(tower: Any, pixels: Tensor, seed: int) -> None:
    """Set the patch embedding to filters whose outputs on the frames are about uncorrelated.

    The filters are the first principal components, scaled to equal variance and rotated at random.
    From random filters, which are noise, the tower needs four times as many frames to see as much
    (the trials are in the model card).

    Args:
        tower: a Qwen2.5-VL vision tower.
        pixels: patches of frames, (frames, patches, values).
        seed: seed of the rotation.
    """
    generator = torch.Generator().manual_seed(seed)
    patches = pixels.flatten(0, 1)
    variances, components = torch.linalg.eigh(patches.T @ patches / len(patches))
    kernel = tower.patch_embed.proj.weight  # (hidden, colours, time, height, width)
    width, colours, n_times, *side = kernel.shape
    n_kept = min(width, len(variances))
    scales = (variances[-n_kept:] + _SMOOTHING * variances.mean()).rsqrt()
    whitened = scales[:, None] * components[:, -n_kept:].T
    rotation = torch.empty(width, n_kept)
    torch.nn.init.orthogonal_(rotation, generator=generator)
    filters = (_SCALE * rotation @ whitened).reshape(width, colours, 1, *side)
    with torch.no_grad():
        # Both time steps are the same picture, and their sum counts.
        kernel.copy_(filters.expand(-1, -1, n_times, -1, -1) / n_times)
