"""Views made by hand: frames of 8 x 8 pixels, 4 x 4 cells of 2 x 2, tokens of 2 x 2 cells."""

import numpy as np

from recipes.nano.views.labelled_views import ThingInView, views_of, write_views

GRID, BLOCK, CELL_PIXELS = 4, 2, 4


def cells(*places, pixels=4):
    """Pixels of a thing in each cell: so many in those at these rows and columns."""
    counts = np.zeros((GRID, GRID), int)
    for row, column in places:
        counts[row, column] = pixels
    return counts


def thing(view, name, pixels, receptacle=None, *, loose=True, held=False, opened=False):
    return ThingInView(view, name, receptacle, loose, held, opened, pixels)


def write(folder, name, n_views, things, seed=0):
    """Write views of random pixels."""
    rng = np.random.default_rng(seed)
    frames = [*rng.integers(0, 256, (n_views, 2 * GRID, 2 * GRID, 3), dtype=np.uint8)]
    path = folder / f"{name}.npz"
    write_views(path, views_of(frames, things))
    return path, np.stack(frames)
