"""Knives, forks, spoons, spatulas and ladles; their handles point towards +z."""

import math

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import CHROME, DARK, STEEL

_BRIGHT: Color = (0.9, 0.92, 0.95)
_IVORY: Color = (0.88, 0.82, 0.66)
_GRIP: Color = (0.15, 0.13, 0.12)


@draws
def knife(b: Builder) -> None:
    """A broad blade that runs to a point, and a dark handle with rivets."""
    b.box((0, 0, 0.66), (0.5, 1, 0.34), _GRIP)
    for at in (0.5, 0.66, 0.82):
        b.box((0, 0.8, at), (0.14, 0.3, 0.02), STEEL)
    b.box((0.15, 0, -0.12), (0.85, 0.4, 0.44), _BRIGHT, Material.METAL)
    b.add(
        Form.CYLINDER, (0.15, 0, -0.56), (0.85, 0.22, 0.4), _BRIGHT, Material.METAL, tilt=(0, 0, 0)
    )


@draws
def butter_knife(b: Builder) -> None:
    """A stout round handle of ivory, a neck, a blade with a round end and a notch."""
    b.ball((0, 0, 0.58), (0.75, 1, 0.42), _IVORY)
    b.box((0, 0, 0.12), (0.35, 0.7, 0.1), CHROME, Material.METAL)
    b.box((0.1, 0, -0.36), (0.9, 0.5, 0.4), _BRIGHT, Material.METAL)
    b.ball((0.1, 0, -0.76), (0.9, 0.5, 0.22), _BRIGHT, Material.METAL)
    b.box((-0.75, 0.1, -0.05), (0.25, 0.6, 0.04), DARK)


@draws
def fork(b: Builder) -> None:
    """A handle that widens to its end, and a broad head with three long tines well apart."""
    b.box((0, 0, 0.74), (0.42, 0.6, 0.26), STEEL, Material.METAL)
    b.box((0, 0, 0.2), (0.22, 0.6, 0.3), STEEL, Material.METAL)
    b.ball((0, 0, -0.28), (1, 0.6, 0.22), STEEL, Material.METAL)
    for at in (-0.8, 0.0, 0.8):
        b.box((at, 0.2, -0.64), (0.2, 0.5, 0.36), CHROME, Material.METAL)


@draws
def spoon(b: Builder) -> None:
    """A handle and a bowl."""
    b.box((0, 0.1, 0.35), (0.3, 0.5, 0.65), STEEL, Material.METAL)
    b.ball((0, 0, -0.65), (1, 1, 0.35), CHROME, Material.METAL)


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
    b.box((0, *middle), (0.1, 0.05, length), CHROME, Material.METAL, tilt=(lean, 0, 0))
    at = (start[0] + 0.8 * (end[0] - start[0]), start[1] + 0.8 * (end[1] - start[1]))
    b.box((0, *at), (0.17, 0.09, length * 0.28), DARK, tilt=(lean, 0, 0))
    b.box((0, 0.8, 0.96), (0.08, 0.14, 0.03), CHROME, Material.METAL)
