"""Balls, bats, rackets and weights."""

import math

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import BLACK, CHROME, DARK, pick

_STRING: Color = (0.3, 0.3, 0.32)


@draws
def ball(b: Builder) -> None:
    """An orange ball with seams."""
    b.ball((0, 0, 0), (0.99, 0.99, 0.99), (0.85, 0.42, 0.12), Material.STONE)
    b.tube((0, 0, 0), (1.005, 0.02, 1.005), BLACK)
    b.add(Form.CYLINDER, (0, 0, 0), (1.005, 0.02, 1.005), BLACK, tilt=(0, 0, 90))


@draws
def bat(b: Builder) -> None:
    """A knob, a wound grip, a slender handle, a thick barrel with two bands and a hollowed end."""
    axis = b.longest
    wood: Color = (0.86, 0.66, 0.4)
    thick = min(float(b.half[i]) for i in range(3) if i != axis)
    b.bar(axis, -1.0, -0.95, (0.5 * thick, 0.5 * thick), wood, Material.WOOD)
    b.bar(axis, -0.95, -0.5, (0.27 * thick, 0.27 * thick), (0.13, 0.13, 0.15), Material.FABRIC)
    b.bar(axis, -0.5, 0.15, (0.27 * thick, 0.8 * thick), wood)
    b.bar(axis, 0.15, 0.94, (0.8 * thick, thick), wood)
    b.bar(axis, 0.32, 0.4, (0.9 * thick, 0.92 * thick), (0.7, 0.15, 0.12))
    b.bar(axis, 0.62, 0.66, (0.95 * thick, 0.96 * thick), (0.13, 0.13, 0.15))
    b.bar(axis, 0.94, 1.0, (thick, 0.8 * thick), shade_of(wood, 1.05))
    b.bar(axis, 0.99, 1.003, (0.5 * thick, 0.5 * thick), shade_of(wood, 0.45))


@draws
def racket(b: Builder) -> None:
    """An oval frame with strings, a forked throat and a wound grip, along its longest side."""
    long = b.longest
    flat = min(range(3), key=lambda i: float(b.half[i]))
    wide = 3 - long - flat

    def at(along: float, across: float = 0.0, up: float = 0.0) -> list[float]:
        """A position or half extents in fractions along the racket, across, and off its face."""
        return [along if axis == long else across if axis == wide else up for axis in range(3)]

    frame = pick(((0.75, 0.12, 0.12), (0.1, 0.25, 0.6), (0.12, 0.12, 0.14)), b.style)
    b.coin(flat, at(0.44), at(0.56, 1.0, 0.75), frame)
    b.coin(flat, at(0.44), at(0.48, 0.86, 0.8), (0.9, 0.9, 0.8))
    for index in range(5):
        offset = (index - 2) / 3
        reach = math.sqrt(1 - offset * offset)
        b.box(at(0.44 + 0.48 * offset), at(0.008, 0.86 * reach, 0.86), _STRING)
        b.box(at(0.44, 0.86 * offset), at(0.48 * reach, 0.02, 0.86), _STRING)
    b.box(at(-0.2), at(0.12, 0.13, 0.6), frame)
    b.cloth(at(-0.66), at(0.34, 0.15, 0.9), BLACK)


@draws
def dumbbell(b: Builder) -> None:
    """Two weights on a bar."""
    b.metal((0, 0, 0), (0.25, 0.25, 1), CHROME)
    for side in (-1, 1):
        b.box((0, 0, side * 0.7), (1, 1, 0.3), DARK)
