"""Randomized looks of a scene: materials, colours and light that differ from the usual ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.render.primitives import COLOR, INSTANCE, MATERIAL, Material

RANDOM_PATTERNS = tuple(int(m) for m in Material if m not in (Material.GLASS, Material.PLAIN))
"""Patterns that a randomized surface may have."""


@dataclass(frozen=True)
class Finish:
    """A randomized surface, of one object or of a part of the shell.

    Attributes:
        tint: factors of its colours (3,).
        pattern: pattern in place of the usual one; None keeps that.
    """

    tint: Array
    pattern: int | None = None


@dataclass
class Appearance:
    """The looks that the randomizing actions change; the defaults are the usual looks.

    Attributes:
        finishes: randomized surfaces, by object id or name of a part of the shell.
        brightness: factor of the daylight.
        light: colour of the light, factors (3,).
    """

    finishes: Mapping[str, Finish] = field(default_factory=dict)
    brightness: float = 1.0
    light: Array = field(default_factory=lambda: np.ones(3))


def apply_finishes(prims: Array, names: Sequence[str], look: Appearance) -> Array:
    """Return primitives (n, COLUMNS) with the looks of `look`; `names` are the instances'."""
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
