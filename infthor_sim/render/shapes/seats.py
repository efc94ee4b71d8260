"""Chairs, sofas, beds and stools."""

from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import CORNERS, Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import BRASS, CLOTHS, WHITE, WOODS, pick


def _seat_level(b: Builder, usual: float) -> float:
    """Return the seat's height as a fraction of the half box: the surface height if known."""
    if b.item.support is None:
        return usual
    return min(0.9, max(-0.8, b.item.support / float(b.half[1]) - 1))


@draws
def chair(b: Builder) -> None:
    """A wooden chair with a back of slats."""
    color = pick(WOODS, b.style)
    level = _seat_level(b, -0.05)
    x, y, z = b.extent(0.018, 0.015, 0.018)
    b.wood((0, level - y, 0), (1, y, 1), color)
    for side in (-1, 1):
        b.box(
            (side * (0.93 - x), (level - 1) / 2, 0.9 - z),
            (x, (level + 1) / 2, z),
            shade_of(color, 0.85),
        )
        b.box((side * (0.93 - x), 0, -0.93), (x, 1, z), shade_of(color, 0.85))
    for share in (0.35, 0.65, 0.95):
        b.wood((0, level + (1 - level) * share - 0.06, -0.93), (0.9, 0.07, z * 0.7), color)


@draws
def stool(b: Builder) -> None:
    """A round seat on legs."""
    color = pick(WOODS, b.style)
    b.tube((0, 0.92, 0), (1, 0.08, 1), color, Material.WOOD)
    for sx, sz in CORNERS:
        b.box(
            (sx * 0.6, -0.08, sz * 0.6),
            (b.thick(0.018, 0), 0.92, b.thick(0.018, 2)),
            shade_of(color, 0.8),
        )


@draws
def sofa(b: Builder) -> None:
    """A padded bench with a back and arms."""
    color = pick(CLOTHS, b.style)
    level = _seat_level(b, -0.05)
    arm = min(0.3, b.thick(0.11, 0))
    back = min(0.5, b.thick(0.11, 2))
    b.cloth(
        (0, (level - 1) / 2 - 0.02, 0),
        (1 - arm, (level + 1) / 2 - 0.05, 0.97),
        shade_of(color, 0.85),
    )
    b.cloth((0, 0.0, -1 + back), (1 - arm, 1, back), color)
    for side in (-1, 1):
        top = min(0.9, level + 0.45)
        b.cloth(
            (side * (1 - arm), (top - 1) / 2, 0), (arm, (top + 1) / 2, 1), shade_of(color, 0.95)
        )
    count = max(1, round(float(b.half[0]) / 0.4))
    width = (1 - 2 * arm) / count
    for index in range(count):
        at = -(1 - 2 * arm) + width * (2 * index + 1)
        b.cloth((at, level - 0.1, back), (width * 0.97, 0.1, 1 - back), shade_of(color, 1.12))


@draws
def ottoman(b: Builder) -> None:
    """A footstool on four turned legs: a frame of cloth with studs, a cushion with buttons."""
    color = pick(CLOTHS, b.style)
    wood = shade_of(pick(WOODS, b.style), 0.7)
    for x in (-0.82, 0.82):
        for z in (-0.76, 0.76):
            b.tube((x, -0.74, z), (0.09, 0.26, 0.13), wood, Material.WOOD, bottom=0.55)
    b.cloth((0, -0.16, 0), (0.96, 0.34, 0.95), shade_of(color, 0.85))
    b.box((0, 0.24, 0), (1, 0.06, 1), shade_of(color, 0.6))
    b.cloth((0, 0.5, 0), (0.98, 0.24, 0.97), color)
    b.ball((0, 0.72, 0), (0.98, 0.28, 0.97), shade_of(color, 1.08), Material.FABRIC)
    for x, z in ((0, 0), (-0.5, -0.42), (0.5, -0.42), (-0.5, 0.42), (0.5, 0.42)):
        b.ball((x, 0.97 - 0.2 * (x * x + z * z), z), (0.06, 0.06, 0.09), shade_of(color, 0.45))
    for index in range(9):
        at = (index - 4) / 4.4
        for side in (-1, 1):
            b.box((at, -0.4, side * 0.96), (0.025, 0.06, 0.01), BRASS)
            b.box((side * 0.97, -0.4, at), (0.01, 0.06, 0.035), BRASS)


@draws
def bed(b: Builder) -> None:
    """A frame with a headboard at its back, a mattress and a blanket."""
    wood = pick(WOODS, b.style)
    cloth = pick(CLOTHS, b.style)
    level = _seat_level(b, 0.2)
    z = b.thick(0.03, 2)
    frame = -1 + (level + 1) * 0.45
    b.wood((0, (frame - 1) / 2, 0), (1, (frame + 1) / 2, 1), shade_of(wood, 0.8))
    b.wood((0, 0, -1 + z), (1, 1, z), wood)
    linen: Color = (0.75, 0.68, 0.55) if b.state.dirty else WHITE
    b.cloth((0, (frame + level) / 2, z), (0.97, (level - frame) / 2, 0.97 - z), linen)
    if not b.state.dirty:
        b.cloth((0, (frame + level) / 2 + 0.012, 0.35), (0.985, (level - frame) / 2, 0.64), cloth)


@draws
def pet_bed(b: Builder) -> None:
    """A flat round cushion with a border."""
    color = pick(CLOTHS, b.style)
    b.tube((0, -0.05, 0), (1, 0.95, 1), shade_of(color, 0.7), Material.FABRIC, top=0.96)
    b.tube((0, 0.9, 0), (0.84, 0.1, 0.84), shade_of(color, 1.15), Material.FABRIC)
