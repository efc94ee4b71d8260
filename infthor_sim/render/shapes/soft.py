"""Things of cloth: pillows, cloths, towels."""

import math

from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import CORNERS, Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import CLOTHS, WHITE, pick

_FOLDS = 5  # of a hanging towel
_RAIL = 0.93  # height at which it hangs, in fractions


@draws
def pillow(b: Builder) -> None:
    """A puffed cushion of one cloth, thickest in the middle, with drawn-out corners."""
    color = shade_of(pick(CLOTHS, b.style), 1.25)
    width, depth = float(b.half[0]), float(b.half[2])
    slant = math.degrees(math.atan2(depth, width))
    corner = 0.42 * math.hypot(width, depth)
    for x, z in CORNERS:
        b.ball((x * 0.47, -0.03, z * 0.47), (0.5, 0.66, 0.5), color, Material.FABRIC)
        half = (corner / width, 0.36, 0.5 * corner / depth)
        b.ball((x * 0.53, -0.03, z * 0.53), half, color, Material.FABRIC,
               tilt=(0, -x * z * slant, 0))  # fmt: skip
    b.ball((0, 0, 0), (0.97, 1, 0.97), color, Material.FABRIC)


@draws
def cloth(b: Builder) -> None:
    """A striped cloth with one side folded over."""
    color: Color = (0.45, 0.38, 0.3) if b.state.dirty else pick(CLOTHS, b.style)
    stripe = shade_of(color, 0.75) if b.state.dirty else WHITE
    b.cloth((0, -0.5, 0), (0.97, 0.5, 0.96), color)
    for at in (-0.8, -0.62, 0.62, 0.8):
        b.cloth((0, -0.48, at), (0.975, 0.5, 0.05), stripe)
    b.cloth((-0.4, 0.4, 0.06), (0.52, 0.55, 0.84), shade_of(color, 1.2), tilt=(0, 14, 2))
    for at in (-0.62, 0.7):
        b.cloth(
            (-0.4 + 0.14 * at, 0.46, 0.06 + 0.85 * at), (0.52, 0.55, 0.06), stripe, tilt=(0, 14, 2)
        )


@draws
def towel(b: Builder) -> None:
    """A cloth with a striped border: in folds over a rail with a fringe, or folded up flat."""
    color = pick(CLOTHS, b.style + 1)
    if min(range(3), key=lambda axis: float(b.half[axis])) == 1:
        for up, share in ((-0.65, 1.0), (0.0, 0.97), (0.65, 0.94)):
            b.cloth((0, up, 0), (share, 0.34, share), color)
        b.cloth((0.6, 0, 0), (0.12, 1.01, 0.945), WHITE)
        return
    across = 0 if b.half[0] >= b.half[2] else 2

    def at(aside: float, up: float, off: float) -> list[float]:
        """A position or half extents in fractions across the cloth, up, and off its face."""
        return [aside if axis == across else up if axis == 1 else off for axis in range(3)]

    b.coin(across, at(0, _RAIL, 0), at(0.8, 1 - _RAIL, 1), shade_of(color, 1.1), Material.FABRIC)
    b.cloth(at(0, 0.2, -0.5), at(0.84, 0.74, 0.3), shade_of(color, 0.7))
    for index in range(_FOLDS):
        aside = (2 * index + 1) / _FOLDS - 1
        raised = index % 2 == 0
        shade = shade_of(color, 1.12 if raised else 0.78)
        off = 0.35 if raised else 0.2
        thick = 0.6 if raised else 0.4
        foot = -0.86 if raised else -0.8
        wide = 1 / _FOLDS
        tall = (_RAIL - foot) / 2
        b.cloth(at(aside * 0.9, _RAIL - tall, off), at(wide, tall, thick), shade)
        for level in (-0.5, -0.66):
            b.cloth(at(aside * 0.9, level, off), at(wide, 0.045, thick + 0.03), WHITE)  # fmt: skip
        for side in (-0.5, 0.5):
            b.box(at((aside + side * wide) * 0.9, (foot - 1) / 2, off),
                  at(0.22 * wide, (1 + foot) / 2, 0.3), shade_of(color, 1.2))  # fmt: skip
