"""Things of cloth: pillows, cloths, towels."""

import math

from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import CLOTHS, WHITE, pick


@draws
def pillow(b: Builder) -> None:
    """A puffed cushion of one cloth, thickest in the middle, with drawn-out corners."""
    color = shade_of(pick(CLOTHS, b.style), 1.25)
    width, depth = float(b.half[0]), float(b.half[2])
    slant = math.degrees(math.atan2(depth, width))
    corner = 0.42 * math.hypot(width, depth)
    for x in (-1, 1):
        for z in (-1, 1):
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
    b.box((0, -0.5, 0), (0.97, 0.5, 0.96), color, Material.FABRIC)
    for at in (-0.8, -0.62, 0.62, 0.8):
        b.box((0, -0.48, at), (0.975, 0.5, 0.05), stripe, Material.FABRIC)
    b.box(
        (-0.4, 0.4, 0.06),
        (0.52, 0.55, 0.84),
        shade_of(color, 1.2),
        Material.FABRIC,
        tilt=(0, 14, 2),
    )
    for at in (-0.62, 0.7):
        b.box(
            (-0.4 + 0.14 * at, 0.46, 0.06 + 0.85 * at),
            (0.52, 0.55, 0.06),
            stripe,
            Material.FABRIC,
            tilt=(0, 14, 2),
        )


@draws
def towel(b: Builder) -> None:
    """A hanging or lying cloth with a border."""
    color = pick(CLOTHS, b.style + 1)
    b.box((0, 0, 0), (1, 1, 1), color, Material.FABRIC)
    flat = min(range(3), key=lambda i: float(b.half[i]))
    half = [1.005] * 3
    at = [0.0] * 3
    axis = 1 if flat != 1 else 2
    half[axis] = 0.06
    at[axis] = -0.75
    b.box(at, half, WHITE, Material.FABRIC)
