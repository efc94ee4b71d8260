"""Knives, forks, spoons, spatulas and ladles; their handles point towards +z."""

import math

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import BLACK, CHROME, DARK, STEEL

_BRIGHT: Color = (0.9, 0.92, 0.95)
_IVORY: Color = (0.88, 0.82, 0.66)
_GRIP: Color = (0.15, 0.13, 0.12)


@draws
def knife(b: Builder) -> None:
    """A broad blade that runs to a point, and a dark handle with rivets."""
    b.box((0, 0, 0.66), (0.5, 1, 0.34), _GRIP)
    for at in (0.5, 0.66, 0.82):
        b.box((0, 0.8, at), (0.14, 0.3, 0.02), STEEL)
    b.metal((0.15, 0, -0.12), (0.85, 0.4, 0.44), _BRIGHT)
    b.add(
        Form.CYLINDER, (0.15, 0, -0.56), (0.85, 0.22, 0.4), _BRIGHT, Material.METAL, tilt=(0, 0, 0)
    )


@draws
def butter_knife(b: Builder) -> None:
    """A slender handle of ivory, and a wider blade with straight sides, a blunt end and a notch."""
    b.box((0, 0, 0.56), (0.6, 1, 0.4), _IVORY)
    b.tube((0, 0, 0.94), (0.6, 1, 0.06), _IVORY)
    b.metal((0, 0, 0.12), (0.4, 0.7, 0.06), CHROME)
    b.metal((0, 0, -0.44), (1, 0.5, 0.48), _BRIGHT)
    b.tube((0, 0, -0.92), (1, 0.5, 0.08), _BRIGHT, Material.METAL)
    b.box((-0.75, 0.1, 0.0), (0.25, 0.6, 0.04), DARK)


@draws
def fork(b: Builder) -> None:
    """A handle that widens to its end, and three long bright tines with dark between them."""
    b.metal((0, 0, 0.78), (0.42, 0.6, 0.22), STEEL)
    b.metal((0, 0, 0.27), (0.22, 0.6, 0.35), STEEL)
    b.ball((0, 0, -0.16), (1, 0.6, 0.16), STEEL, Material.METAL)
    b.box((0, 0.25, -0.48), (0.8, 0.35, 0.28), BLACK)
    for at in (-0.83, 0.0, 0.83):
        b.metal((at, 0.2, -0.58), (0.17, 0.5, 0.42), _BRIGHT)


@draws
def spoon(b: Builder) -> None:
    """A bowl that is dark within its bright rim, and a handle that widens to a round end."""
    b.bowl((0, -0.1, -0.62), (1, 0.9, 0.38), _BRIGHT, Material.METAL)
    b.bowl((0, 0.1, -0.62), (0.74, 0.72, 0.28), shade_of(STEEL, 0.45))
    b.metal((0, 0.5, 0.22), (0.16, 0.35, 0.48), STEEL)
    b.metal((0, 0.5, 0.78), (0.3, 0.4, 0.14), STEEL)
    b.tube((0, 0.5, 0.9), (0.3, 0.4, 0.1), STEEL, Material.METAL)


@draws
def spatula(b: Builder) -> None:
    """A slotted blade on a long handle."""
    b.box((0, 0.2, 0.35), (0.22, 0.6, 0.65), DARK)
    b.box((0, -0.3, -0.65), (1, 0.5, 0.35), (0.3, 0.3, 0.32))
    for at in (-0.4, 0.0, 0.4):
        b.box((at, 0.25, -0.65), (0.1, 0.1, 0.22), (0.6, 0.6, 0.62))


@draws
def ladle(b: Builder) -> None:
    """A deep round bowl, and a long handle that rises from its rim to a dark grip with a hook."""
    b.bowl((0, -0.58, -0.68), (0.95, 0.42, 0.31), STEEL, Material.METAL)
    b.bowl((0, -0.54, -0.68), (0.84, 0.4, 0.27), shade_of(STEEL, 0.5))
    start, end = (-0.24, -0.4), (0.86, 0.9)  # height and place along, in fractions
    rise = (end[0] - start[0]) * float(b.half[1])
    run = (end[1] - start[1]) * float(b.half[2])
    lean = -math.degrees(math.atan2(rise, run))
    length = math.hypot(rise, run) / 2 / float(b.half[2])
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    b.metal((0, *middle), (0.1, 0.05, length), CHROME, tilt=(lean, 0, 0))
    at = (start[0] + 0.8 * (end[0] - start[0]), start[1] + 0.8 * (end[1] - start[1]))
    b.box((0, *at), (0.17, 0.09, length * 0.28), DARK, tilt=(lean, 0, 0))
    b.metal((0, 0.8, 0.96), (0.08, 0.14, 0.03), CHROME)
