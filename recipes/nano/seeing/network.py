"""The tower as it learns to see: losses of its units, and of a name for each patch."""

from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, log_softmax

from recipes.nano.seeing.labels import cell_shares, token_labels
from recipes.nano.seeing.units import Role
from recipes.nano.seeing.view_dataset import ViewBatch, ViewDataset
from recipes.nano.tower import patch_states, unit_logits

_ROLE_WEIGHTS = {Role.SHOWN: 1.0, Role.HELD: 2.0, Role.OPEN: 2.0, Role.AROUND: 1.0}
_PATCH_WEIGHT = 3.0  # of the loss of patches' names
_LOOSE_WEIGHT = 3.0  # more, of patches that show something loose
_BIAS = -4.0  # of the units at first: hardly any is on
_SCALE = 2.0  # of their weights


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
