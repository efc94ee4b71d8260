"""Applying randomized colours and patterns to a scene's primitives."""

from collections.abc import Sequence

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.pictures.appearance import Appearance
from infthor_sim.render.primitives import COLOR, INSTANCE, MATERIAL, Material

__all__ = ["RANDOM_PATTERNS", "apply_finishes"]

RANDOM_PATTERNS = tuple(int(m) for m in Material if m not in (Material.GLASS, Material.PLAIN))
"""Patterns that a randomized surface may have."""


def apply_finishes(prims: Array, names: Sequence[str], look: Appearance) -> Array:
    """Return the primitives (n, COLUMNS) with the looks of `look`; `names` are those of the
    instances."""
    # Brightness does not count: it changes the lights and not a surface.
    if not look.finishes and np.all(look.light == 1.0):
        return prims
    tints = np.tile(look.light, (len(names), 1))
    patterns = np.full(len(names), -1)
    for index, name in enumerate(names):
        finish = look.finishes.get(name)
        if finish is not None:
            tints[index] *= finish.tint
            patterns[index] = -1 if finish.pattern is None else finish.pattern
    instance = prims[:, INSTANCE].astype(int)
    out = prims.copy()
    out[:, COLOR : COLOR + 3] = np.minimum(prims[:, COLOR : COLOR + 3] * tints[instance], 1.0)
    # Glass keeps its pattern: the picture has no transparency, and only the pattern makes a pane
    # look like one.
    solid = (prims[:, MATERIAL] != Material.GLASS) & (patterns[instance] >= 0)
    out[solid, MATERIAL] = patterns[instance][solid]
    return out
