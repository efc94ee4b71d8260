"""What the tower should see in pictures: labels of units, and shares of types in each cell.

Pixels are those of frames of 300 x 300, of which a thousandth counts as seen in questions.
"""

import numpy as np
from numpy.typing import NDArray

from recipes.nano.seeing.units import Role
from recipes.nano.seeing.view_dataset import ViewBatch

# Something is in a token's part of the picture if it has so many pixels there, and either so large
# a share of what it has in the part with most of it, or of the part.
_LEAST = 60
_OF_LARGEST = 0.25
_OF_TOKEN = 0.3
_OF_THING = 0.2  # of all its pixels, also outside of the picture
_UNCLEAR = 8  # pixels from which on it may be told, or not

_LOOSE_WEIGHT = 4.0  # of the pixels of loose things, which are small


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
    weights = np.where(batch.loose, _LOOSE_WEIGHT, 1.0)[:, None]
    np.add.at(shares, (batch.picture, batch.type), batch.pixels * weights)
    covered = np.zeros((n_pictures, n_cells), np.float32)
    np.add.at(covered, batch.picture, batch.pixels)
    shares[:, -1] = np.maximum(cell_pixels - covered, 0)
    shares /= shares.sum(1, keepdims=True)
    return shares.swapaxes(1, 2)
