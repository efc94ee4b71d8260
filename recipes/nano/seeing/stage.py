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
from recipes.nano.whitening import whiten_patches

_WHITENED_FRAMES = 600
_SHIFT = 2.0  # logits by which units are raised when the tower is trained
_RAISED = 1.0  # logits by which those of what is shown are once more, when the decoder is


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
