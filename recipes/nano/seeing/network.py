"""The tower as it learns to see: losses of its units, and of a name for each patch.

It should tell labels of units, and shares of types in each cell. Pixels are those of frames of
300 x 300, of which a thousandth counts as seen in questions.
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, log_softmax

from recipes.nano.seeing.units import Role
from recipes.nano.seeing.view_dataset import ViewBatch, ViewDataset
from recipes.nano.tower import patch_states, unit_logits

_ROLE_WEIGHTS = {Role.SHOWN: 1.0, Role.HELD: 2.0, Role.OPEN: 2.0, Role.AROUND: 1.0}
_PATCH_WEIGHT = 3.0  # of the loss of patches' names
_LOOSE_WEIGHT = 3.0  # more, of patches that show something loose
_BIAS = -4.0  # of the units at first: hardly any is on
_SCALE = 2.0  # of their weights
# Something is in a token's part of the picture if it has so many pixels there, and either so large
# a share of what it has in the part with most of it, or of the part.
_LEAST = 60
_OF_LARGEST = 0.25
_OF_TOKEN = 0.3
_OF_THING = 0.2  # of all its pixels, also outside of the picture
_UNCLEAR = 8  # pixels from which on it may be told, or not
_LOOSE_PIXEL_WEIGHT = 4.0  # of those of loose things, which are small


class SeeingNetwork(torch.nn.Module):
    """The tower, and a layer that names patches, which is not part of the model.

    Args:
        tower: a Qwen2.5-VL vision tower; its merger's first layer gets the units.
        views: the views to learn from.
        image_processor: makes the inputs of the tower from frames.
    """

    def __init__(self, tower: Any, views: ViewDataset, image_processor: Any) -> None:
        super().__init__()
        self.tower = tower
        self._views = views
        self._mean = torch.tensor(image_processor.image_mean)
        self._deviation = torch.tensor(image_processor.image_std)
        width = tower.patch_embed.proj.out_channels
        self.norm = torch.nn.RMSNorm(width)
        self.names = torch.nn.Linear(width, len(views.units.types) + 1)
        layer, n_units = tower.merger.mlp[0], len(views.units)
        with torch.no_grad():
            layer.weight[:n_units] *= _SCALE
            layer.weight[n_units:] = 0.0
            layer.bias.zero_()
            layer.bias[:n_units] = _BIAS

    def inputs(self, batch: ViewBatch) -> Tensor:
        """Return the patches of a batch as the image processor makes them, (pictures, patches,
        values)."""
        pixels = torch.from_numpy(batch.patches).float().div_(255)
        colours = pixels.reshape(*pixels.shape[:2], -1, 3)
        return ((colours - self._mean) / self._deviation).transpose(2, 3).flatten(2)

    def loss(self, batch: ViewBatch) -> Tensor:
        """Return the loss of a batch, a scalar."""
        states = patch_states(self.tower, self.inputs(batch))
        return self._unit_loss(states, batch) + _PATCH_WEIGHT * self._name_loss(states, batch)

    def _unit_loss(self, states: Tensor, batch: ViewBatch) -> Tensor:
        """Return the loss of the units, summed over them, averaged over tokens."""
        units, block = self._views.units, self.tower.spatial_merge_size
        labels, unclear = token_labels(batch, block, self._views.cell_pixels, len(units.types))
        logits = unit_logits(self.tower, states, len(units)).reshape(labels.shape)
        losses = binary_cross_entropy_with_logits(
            logits, torch.from_numpy(labels).float(), reduction="none"
        )
        weights = torch.tensor([_ROLE_WEIGHTS[role] for role in Role])[:, None]
        is_ignored = torch.zeros(labels.shape, dtype=torch.bool)
        is_ignored[:, :, Role.SHOWN] = torch.from_numpy(unclear)
        return (losses * weights).masked_fill(is_ignored, 0.0).sum((2, 3)).mean()

    def _name_loss(self, states: Tensor, batch: ViewBatch) -> Tensor:
        """Return the cross entropy of the patches' names, averaged over patches."""
        n_types = len(self._views.units.types)
        shares = torch.from_numpy(cell_shares(batch, self._views.cell_pixels, n_types))
        losses = -(shares * log_softmax(self.names(self.norm(states)), -1)).sum(-1)
        loose = shares[..., :-1] @ torch.from_numpy(self._views.loose).float()
        weights = 1 + _LOOSE_WEIGHT * loose
        return (losses * weights).sum() / weights.sum()


def token_labels(
    batch: ViewBatch, block: int, cell_pixels: int, n_types: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the labels of each token, and which types it may show or not.

    Args:
        batch: pictures.
        block: cells along each side of a token's part.
        cell_pixels: pixels of a cell.
        n_types: number of types.

    Returns:
        Labels, [pictures, tokens, roles, types], and what is unclear, [pictures, tokens, types].
    """
    n_pictures, n_cells, _ = batch.patches.shape
    n_tokens = n_cells // block**2
    pixels = batch.pixels.reshape(-1, n_tokens, block**2).sum(2)
    token = cell_pixels * block**2
    largest = pixels.max(1, keepdims=True)
    whole = np.minimum(batch.n_pixels, token)[:, None]
    is_in = (pixels >= _LEAST) & ((pixels >= _OF_LARGEST * largest) | (pixels >= _OF_TOKEN * token))
    is_in &= (pixels >= _OF_THING * whole) | (pixels >= _OF_TOKEN * token)
    labels = np.zeros((n_pictures, n_tokens, len(Role), n_types), bool)
    held_or_lost = batch.held | ~batch.loose | (batch.receptacle < 0)
    for role, of_role, types in (
        (Role.SHOWN, np.ones(len(pixels), bool), batch.type),
        (Role.HELD, batch.held, batch.type),
        (Role.OPEN, batch.opened, batch.type),
        (Role.AROUND, ~held_or_lost, batch.receptacle),
    ):
        thing, tokens = np.nonzero(is_in & of_role[:, None])
        labels[batch.picture[thing], tokens, role, types[thing]] = True
    unclear = np.zeros((n_pictures, n_tokens, n_types), bool)
    thing, tokens = np.nonzero((pixels >= _UNCLEAR) & ~is_in)
    unclear[batch.picture[thing], tokens, batch.type[thing]] = True
    return labels, unclear & ~labels[:, :, Role.SHOWN]


def cell_shares(batch: ViewBatch, cell_pixels: int, n_types: int) -> NDArray[np.float32]:
    """Return the share of each type in each cell, and that of all else, [pictures, cells, types +
    1]; loose things count for more than they cover."""
    n_pictures, n_cells, _ = batch.patches.shape
    shares = np.zeros((n_pictures, n_types + 1, n_cells), np.float32)
    weights = np.where(batch.loose, _LOOSE_PIXEL_WEIGHT, 1.0)[:, None]
    np.add.at(shares, (batch.picture, batch.type), batch.pixels * weights)
    covered = np.zeros((n_pictures, n_cells), np.float32)
    np.add.at(covered, batch.picture, batch.pixels)
    shares[:, -1] = np.maximum(cell_pixels - covered, 0)
    shares /= shares.sum(1, keepdims=True)
    return shares.swapaxes(1, 2)
