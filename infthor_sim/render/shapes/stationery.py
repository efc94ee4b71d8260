"""Small flat and thin things: pens, pencils, cards, keys."""

import math

from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import BLACK, BRASS, CHROME, STEEL, WHITE, pick

_TAGS: tuple[Color, ...] = (
    (0.75, 0.15, 0.15), (0.12, 0.32, 0.75), (0.15, 0.58, 0.25), (0.95, 0.78, 0.15),
    (0.55, 0.25, 0.65), (0.93, 0.5, 0.12), (0.12, 0.12, 0.14),
)  # fmt: skip


@draws
def card(b: Builder) -> None:
    """A bright plastic card: a gold chip, a white line of numbers, its maker's two discs."""
    b.box(
        (0, -0.1, 0),
        (1, 0.9, 1),
        pick(((0.1, 0.32, 0.8), (0.05, 0.5, 0.42), (0.45, 0.15, 0.6)), b.style),
    )
    b.box((-0.62, 0.85, -0.2), (0.2, 0.1, 0.26), (0.95, 0.8, 0.35))
    b.box((-0.05, 0.85, 0.35), (0.78, 0.1, 0.1), WHITE)
    b.tube((0.42, 0.85, -0.42), (0.24, 0.1, 0.42), (0.9, 0.15, 0.12))
    b.tube((0.68, 0.88, -0.42), (0.24, 0.1, 0.42), (1.0, 0.65, 0.1))


@draws
def pen(b: Builder) -> None:
    """A round pen: a cap with a clip, a barrel, a point."""
    axis = b.longest
    thick = _thickness(b)
    color = pick(((0.1, 0.15, 0.5), (0.1, 0.1, 0.1), (0.6, 0.1, 0.1)), b.style)
    b.bar(axis, -1.0, -0.92, (0.2 * thick, 0.5 * thick), STEEL, Material.METAL)
    b.bar(axis, -0.92, -0.8, (0.5 * thick, 0.9 * thick), color)
    b.bar(axis, -0.8, 0.25, (0.9 * thick, 0.9 * thick), (0.9, 0.9, 0.92))
    b.bar(axis, 0.25, 1.0, (thick, thick), color)
    b.bar(axis, 0.22, 0.28, (1.1 * thick, 1.1 * thick), STEEL, Material.METAL)


@draws
def pencil(b: Builder) -> None:
    """A yellow pencil: a rubber in a metal ring, a cone of wood, a black point."""
    axis = b.longest
    thick = 1.15 * _thickness(b)
    b.bar(axis, -1.0, -0.93, (0.1 * thick, 0.36 * thick), BLACK)
    b.bar(axis, -0.93, -0.74, (0.36 * thick, thick), (0.88, 0.7, 0.48))
    b.bar(axis, -0.74, 0.74, (thick, thick), (0.98, 0.76, 0.08))
    b.bar(axis, 0.74, 0.86, (1.05 * thick, 1.05 * thick), STEEL, Material.METAL)
    b.bar(axis, 0.86, 1.0, (thick, thick), (0.93, 0.45, 0.5))


def _thickness(b: Builder) -> float:
    """Return half of the second longest side, metres: a round thing's thickness in its box."""
    return sorted(float(v) for v in b.half)[1]


@draws
def keys(b: Builder) -> None:
    """A ring with two keys spread apart and a tag, whose colours tell one from another."""
    wide = float(b.half[0])
    deep = float(b.half[2])
    for index in range(10):
        angle = 36.0 * index
        x, z = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        across = 0.42 * min(wide, deep * 1.2)
        at = (-0.5 + across * x / wide, 0.0, across * z / deep)
        b.metal(at, (0.36 * across / wide, 0.8, 0.006 / deep), CHROME, tilt=(0, angle, 0))
    _key(b, 14.0, pick((BRASS, STEEL, (0.72, 0.42, 0.28)), b.mark // len(_TAGS)))
    _key(b, -20.0, STEEL)
    b.tube((-0.82, 0.1, 0.3), (0.2, 0.9, 0.34), pick(_TAGS, b.mark))


def _key(b: Builder, angle: float, color: Color) -> None:
    """A key from the ring at (-0.5, 0, 0) outwards: a head with a hole, a shaft, two teeth."""
    wide = float(b.half[0])
    deep = float(b.half[2])
    x, z = math.cos(math.radians(angle)), math.sin(math.radians(angle))

    def at(along: float, across: float) -> tuple[float, float, float]:
        """Fractions of the place `along` the key and `across` it, in shares of the half width."""
        return -0.5 + along * x - across * z, 0.3, (along * z + across * x) * wide / deep

    turn = (0.0, -angle, 0.0)
    b.tube(at(0.5, 0), (0.24, 0.6, 0.24 * wide / deep), color, Material.METAL)
    b.tube(at(0.44, 0), (0.08, 0.9, 0.08 * wide / deep), shade_of(color, 0.35))
    b.metal(at(1.05, 0), (0.42, 0.5, 0.07 * wide / deep), color, tilt=turn)
    for along in (1.2, 1.38):
        b.metal(at(along, 0.13), (0.05, 0.5, 0.1 * wide / deep), shade_of(color, 0.9), tilt=turn)
