"""Surface patterns: a brightness factor from two metric coordinates on the surface.

Each function works alike on floats (compiled by numba) and on arrays (numpy), so that both
renderers draw the same picture. They use arithmetic only, as library functions such as sines may
differ in the last bit between the two. Shades of boards and tiles are multiples of the constants of
the R2 low-discrepancy sequence: neighbours always differ.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from infthor_sim.render.primitives import Material


def wood(a: Any, b: Any) -> Any:
    """Grain along `a`."""
    bend = np.abs(a * 1.3 - np.floor(a * 1.3) - 0.5)
    at = b * 16.0 + bend
    return 0.84 + 0.32 * np.abs(at - np.floor(at) - 0.5)


def planks(a: Any, b: Any) -> Any:
    """Floor boards of 12 cm along `a`, each of its own shade, with joints."""
    line = np.floor(b / 0.12)
    along = a / 0.9 + line * 0.37
    shade = (line * 0.7548776662 + np.floor(along) * 0.5698402910) * 3.7
    across = b / 0.12 - line
    joint = (across < 0.05) | (along - np.floor(along) < 0.008)
    return (0.82 + 0.18 * (shade - np.floor(shade))) * (1.0 - 0.3 * joint)


def tiles(a: Any, b: Any) -> Any:
    """Tiles of 30 cm with grout."""
    x, y = a / 0.3, b / 0.3
    shade = (np.floor(x) * 0.7548776662 + np.floor(y) * 0.5698402910) * 5.3
    grout = (x - np.floor(x) < 0.03) | (y - np.floor(y) < 0.03)
    return (0.93 + 0.07 * (shade - np.floor(shade))) * (1.0 - 0.25 * grout)


def fabric(a: Any, b: Any) -> Any:
    """A coarse weave."""
    x, y = a * 45.0, b * 45.0
    return 0.88 + 0.24 * (np.abs(x - np.floor(x) - 0.5) * np.abs(y - np.floor(y) - 0.5)) * 2.0


def stone(a: Any, b: Any) -> Any:
    """Speckles of 15 mm."""
    x, y = np.floor(a / 0.015), np.floor(b / 0.015)
    shade = x * 0.7548776662 + y * 0.5698402910 + x * y * 0.3183098862
    return 0.88 + 0.12 * (shade - np.floor(shade))


def metal(a: Any, b: Any) -> Any:
    """Broad diagonal sheen."""
    at = (a + b) * 1.6
    return 0.86 + 0.28 * np.abs(at - np.floor(at) - 0.5)


def glass(a: Any, b: Any) -> Any:
    """Wide diagonal streaks of light."""
    at = (a + b) * 1.1
    streak = at - np.floor(at)
    return 0.85 + 0.25 * ((streak > 0.45) & (streak < 0.6))


def paper(a: Any, b: Any) -> Any:
    """Printed lines across `b`."""
    at = b * 60.0
    return 1.0 - 0.22 * ((at - np.floor(at) < 0.35) & (np.abs(a) < 0.5))


def carpet(a: Any, b: Any) -> Any:
    """Tufts of 2 cm."""
    x, y = np.floor(a / 0.02), np.floor(b / 0.02)
    shade = x * 0.7548776662 + y * 0.5698402910 + x * y * 0.3183098862
    return 0.9 + 0.1 * (shade - np.floor(shade))


PATTERNS: dict[Material, Callable[[Any, Any], Any]] = {
    Material.WOOD: wood,
    Material.PLANKS: planks,
    Material.TILES: tiles,
    Material.FABRIC: fabric,
    Material.STONE: stone,
    Material.METAL: metal,
    Material.GLASS: glass,
    Material.PAPER: paper,
    Material.CARPET: carpet,
}
