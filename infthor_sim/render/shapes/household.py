"""Small things of living rooms, bedrooms and bathrooms."""

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import (
    BLACK,
    BRASS,
    CERAMICS,
    CHROME,
    DARK,
    LEAF,
    PAPER,
    WHITE,
    WOODS,
    pick,
)

_COVERS: tuple[Color, ...] = (
    (0.6, 0.18, 0.15),
    (0.18, 0.3, 0.5),
    (0.2, 0.42, 0.3),
    (0.55, 0.42, 0.2),
)
_NEWSPRINT: Color = (0.87, 0.86, 0.81)
_LABELS: tuple[Color, ...] = (
    (0.8, 0.2, 0.18), (0.16, 0.35, 0.72), (0.2, 0.6, 0.32), (0.95, 0.76, 0.2), (0.5, 0.25, 0.6),
    (0.93, 0.93, 0.93), (0.15, 0.15, 0.17),
)  # fmt: skip
_SOAPS: tuple[Color, ...] = (
    (0.95, 0.86, 0.74), (0.92, 0.66, 0.68), (0.68, 0.83, 0.66), (0.66, 0.78, 0.9),
    (0.8, 0.72, 0.9),
)  # fmt: skip
_SOAP_MARKS = (1.1, 0.72, 0.88)  # shades of the mark, relative to the soap


@draws
def book(b: Builder) -> None:
    """Covers around pages; two leaves when open."""
    color = pick(_COVERS, b.style)
    if b.state.openness > 0:
        for side in (-1, 1):
            b.box((side * 0.5, 0.2, 0), (0.48, 0.6, 0.96), PAPER, Material.PAPER)
            b.box((side * 0.5, -0.8, 0), (0.5, 0.2, 1), color)
        return
    b.box((0.03, 0, 0), (0.94, 0.7, 0.96), PAPER)
    for side in (-1, 1):
        b.cloth((0, side * 0.86, 0), (1, 0.14, 1), color)
    b.box((-0.95, 0, 0), (0.05, 1, 1), shade_of(color, 0.8))
    b.box((0.1, 0.99, 0.2), (0.5, 0.02, 0.3), shade_of(color, 1.6))


@draws
def newspaper(b: Builder) -> None:
    """A folded paper: a title, a picture and columns of text on top, its leaves at the sides."""
    for level, half, size in ((-0.6, 0.4, 1.0), (-0.04, 0.16, 0.97), (0.5, 0.4, 0.985)):
        color = _NEWSPRINT if half > 0.2 else shade_of(_NEWSPRINT, 0.6)
        b.box((0, level, 0), (size, half, size), color)
    b.box((-0.1, 0.92, -0.7), (0.72, 0.06, 0.15), BLACK)
    b.box((0, 0.92, -0.44), (0.92, 0.05, 0.025), DARK)
    b.box((-0.48, 0.92, 0.22), (0.42, 0.06, 0.5), (0.42, 0.45, 0.5))
    for at in (0.14, 0.46, 0.78):
        b.box((at, 0.92, 0.25), (0.12, 0.05, 0.56), shade_of(_NEWSPRINT, 0.72))


@draws
def disc(b: Builder) -> None:
    """A shiny disc with a hole and a coloured label."""
    b.tube((0, 0, 0), (1, 1, 1), (0.75, 0.8, 0.88), Material.METAL)
    b.tube((0, 0.08, 0), (0.72, 1, 0.72), pick(_LABELS, b.mark))
    b.tube((0, 0.12, 0), (0.38, 1, 0.38), (0.82, 0.86, 0.92), Material.METAL)
    b.tube((0, 0.16, 0), (0.18, 1, 0.18), (0.25, 0.26, 0.3))
    b.box((0, 0.1, 0.54), (0.4, 1, 0.06), pick((WHITE, BLACK), b.mark // len(_LABELS)))


@draws
def watch(b: Builder) -> None:
    """A white dial in a metal case with a crown, on a closed strap narrower than the case."""
    strap = pick(((0.12, 0.12, 0.13), (0.42, 0.24, 0.12), (0.16, 0.22, 0.42)), b.style)
    case = pick((CHROME, BRASS), b.style)
    b.box((0, -0.92, 0), (0.66, 0.08, 0.48), strap)
    for side in (-1, 1):
        b.box((side * 0.82, -0.3, 0), (0.1, 0.66, 0.48), strap, tilt=(0, 0, side * -8))
        b.box((side * 0.62, 0.42, 0), (0.36, 0.12, 0.48), strap, tilt=(0, 0, side * -16))
    round_x = min(0.62, 0.9 * float(b.half[2] / b.half[0]))
    b.tube((0, 0.52, 0), (round_x, 0.36, 0.9), case, Material.METAL)
    b.tube((0, 0.88, 0), (round_x * 0.82, 0.04, 0.74), WHITE)
    b.box((0, 0.93, -0.22), (0.06, 0.04, 0.28), BLACK)
    b.box((0.16, 0.93, 0.05), (0.18, 0.04, 0.09), BLACK)
    b.metal((0, 0.52, 0.94), (0.09, 0.12, 0.06), case)


@draws
def teddy(b: Builder) -> None:
    """Body, head, ears, arms and legs."""
    fur: Color = (0.6, 0.42, 0.25)
    b.ball((0, -0.35, 0), (0.6, 0.55, 0.7), fur, Material.STONE)
    b.ball((0, 0.5, 0.05), (0.5, 0.42, 0.6), fur, Material.STONE)
    b.ball((0, 0.42, 0.55), (0.2, 0.15, 0.3), shade_of(fur, 1.4))
    for side in (-1, 1):
        b.ball((side * 0.4, 0.85, 0), (0.18, 0.15, 0.2), shade_of(fur, 0.9))
        b.ball((side * 0.72, -0.1, 0.1), (0.28, 0.2, 0.3), fur)
        b.ball((side * 0.4, -0.82, 0.45), (0.28, 0.18, 0.5), fur)
        b.ball((side * 0.18, 0.6, 0.6), (0.05, 0.05, 0.05), BLACK)


@draws
def candle(b: Builder) -> None:
    """A wax stick with a wick, and a flame when lit."""
    b.tube(
        (0, -0.15, 0),
        (1, 0.85, 1),
        pick(((0.93, 0.88, 0.75), (0.7, 0.3, 0.3), (0.5, 0.6, 0.7)), b.style),
    )
    b.tube((0, 0.8, 0), (0.08, 0.15, 0.08), BLACK)
    if b.state.toggled:
        b.ball((0, 1.0, 0), (0.25, 0.25, 0.25), (1.0, 0.75, 0.2), glow=1.0)


@draws
def vase(b: Builder) -> None:
    """A belly with a narrow neck."""
    color = pick(CERAMICS, b.style + 1)
    if b.state.broken:
        _shards(b, color)
        return
    b.ball((0, -0.3, 0), (1, 0.7, 1), color)
    b.cup((0, 0.6, 0), (0.55, 0.4, 0.55), color, bottom=0.6)


@draws
def statue(b: Builder) -> None:
    """A human figure of one colour on a plinth: robe, chest, head, an arm up, one at its hip."""
    color = pick((BRASS, (0.78, 0.76, 0.73), (0.42, 0.36, 0.32)), b.style)
    if b.state.broken:
        _shards(b, color)
        return
    b.box((0, -0.92, 0), (0.8, 0.08, 0.9), DARK)
    b.metal((0, -0.8, 0), (0.64, 0.06, 0.76), shade_of(color, 0.75))
    b.tube((0, -0.38, 0), (0.46, 0.38, 0.56), color, Material.METAL, top=0.62)
    b.tube((0, 0.16, 0), (0.46, 0.22, 0.46), color, Material.METAL, bottom=0.6)
    b.ball((0, 0.38, 0), (0.5, 0.09, 0.48), color, Material.METAL)
    b.tube((0, 0.47, 0), (0.12, 0.08, 0.16), color, Material.METAL)
    b.ball((0, 0.65, 0.02), (0.23, 0.17, 0.34), color, Material.METAL)
    b.metal((-0.6, 0.6, 0), (0.1, 0.28, 0.17), color, tilt=(0, 0, 18))
    b.ball((-0.74, 0.9, 0), (0.13, 0.08, 0.2), color, Material.METAL)
    b.metal((0.55, 0.2, 0), (0.1, 0.17, 0.17), color, tilt=(0, 0, 22))
    b.metal((0.5, -0.04, 0.05), (0.1, 0.15, 0.17), color, tilt=(0, 0, -35))


def _shards(b: Builder, color: Color) -> None:
    for index, (x, z) in enumerate(
        ((-0.6, -0.4), (0.1, 0.5), (0.6, -0.2), (-0.2, 0.0), (0.4, 0.6))
    ):
        b.box((x, -0.85, z), (0.3, 0.12, 0.2), color, tilt=(0, 40 * index, 12))


@draws
def plant(b: Builder) -> None:
    """Leaves in a pot."""
    b.tube((0, -0.72, 0), (0.6, 0.28, 0.6), (0.62, 0.34, 0.22), top=1.0, bottom=0.75)
    b.tube((0, -0.3, 0), (0.08, 0.4, 0.08), (0.35, 0.25, 0.12))
    for x, y, z in (
        (0.0, 0.55, 0.0),
        (-0.5, 0.15, 0.2),
        (0.5, 0.25, -0.2),
        (0.1, 0.1, 0.55),
        (-0.1, 0.3, -0.55),
    ):
        b.ball((x, y, z), (0.45, 0.4, 0.4), shade_of(LEAF, 0.85 + 0.3 * abs(x)), Material.STONE)


def _bottle_with_head(b: Builder, color: Color, head: Color) -> None:
    b.tube((0, -0.3, 0), (1, 0.7, 1), color, top=0.85)
    b.tube((0, 0.55, 0), (0.3, 0.2, 0.3), head)
    b.box((0, 0.88, 0.25), (0.35, 0.12, 0.65), head)


@draws
def soap_bottle(b: Builder) -> None:
    """A bottle with a pump, grey when used up."""
    color: Color = (
        (0.8, 0.8, 0.8)
        if b.state.used_up
        else pick(((0.3, 0.65, 0.7), (0.85, 0.6, 0.25), (0.6, 0.75, 0.4)), b.style)
    )
    _bottle_with_head(b, color, WHITE)


@draws
def spray_bottle(b: Builder) -> None:
    """A bottle with a trigger."""
    _bottle_with_head(b, pick(((0.25, 0.45, 0.8), (0.3, 0.7, 0.4)), b.style), (0.85, 0.25, 0.2))


@draws
def soap_bar(b: Builder) -> None:
    """A rounded bar with an oval mark on top."""
    color = pick(_SOAPS, b.mark)
    b.box((0, -0.1, 0), (0.76, 0.9, 1), color)
    b.box((0, -0.1, 0), (1, 0.9, 0.84), color)
    for x in (-0.76, 0.76):
        for z in (-0.84, 0.84):
            b.tube((x, -0.1, z), (0.24, 0.9, 0.16), color)
    mark = _SOAP_MARKS[b.mark // len(_SOAPS) % len(_SOAP_MARKS)]
    b.tube((0, 0.8, 0), (0.55, 0.1, 0.62), shade_of(color, mark))


@draws
def sponge(b: Builder) -> None:
    """Two layers."""
    b.box((0, -0.3, 0), (1, 0.7, 1), (0.95, 0.82, 0.25), Material.STONE)
    b.cloth((0, 0.7, 0), (1, 0.3, 1), (0.25, 0.5, 0.3))


@draws
def toilet_paper(b: Builder) -> None:
    """An upright roll with a core, thin when used up."""
    color: Color = (0.7, 0.6, 0.45) if b.state.used_up else WHITE
    width = 0.4 if b.state.used_up else 1.0
    b.tube((0, 0, 0), (width, 1, width), color, Material.FABRIC)
    b.tube((0, 0.02, 0), (0.35, 1, 0.35), (0.6, 0.48, 0.33))


@draws
def tissue_box(b: Builder) -> None:
    """A box with a tissue sticking out."""
    b.box((0, -0.15, 0), (1, 0.85, 1), pick(((0.5, 0.65, 0.8), (0.8, 0.6, 0.65)), b.style))
    if not b.state.used_up:
        b.tube((0, 0.8, 0), (0.3, 0.2, 0.3), WHITE, bottom=0.4)


@draws
def plunger(b: Builder) -> None:
    """A red bell of rubber with a flange, on a stick of wood."""
    color: Color = (0.65, 0.2, 0.15)
    b.tube((0, -0.94, 0), (1, 0.06, 1), shade_of(color, 0.8))
    b.tube((0, -0.8, 0), (0.94, 0.1, 0.94), color, top=0.85)
    b.tube((0, -0.63, 0), (0.8, 0.08, 0.8), color, top=0.35)
    b.tube((0, 0.2, 0), (0.16, 0.8, 0.16), pick(WOODS, b.style))


@draws
def scrub_brush(b: Builder) -> None:
    """A toilet brush in its tall white pot: bristles at its rim, a long plastic handle."""
    color = pick(((0.2, 0.45, 0.75), (0.15, 0.55, 0.5)), b.style)
    b.tube((0, -0.66, 0), (0.9, 0.34, 0.9), WHITE)
    b.tube((0, -0.95, 0), (1, 0.05, 1), color)
    b.tube((0, -0.34, 0), (0.98, 0.04, 0.98), color)
    for turn in (0, 45, 90, 135):
        b.box((0, -0.19, 0), (0.66, 0.11, 0.1), (0.8, 0.86, 0.9), tilt=(0, turn, 0))
    b.tube((0, 0.38, 0), (0.17, 0.48, 0.17), color)
    b.ball((0, 0.88, 0), (0.32, 0.12, 0.32), color)


@draws
def boots(b: Builder) -> None:
    """Two shafts with feet."""
    for side in (-1, 1):
        b.box((side * 0.5, 0.1, -0.4), (0.42, 0.9, 0.5), (0.35, 0.22, 0.12))
        b.box((side * 0.5, -0.78, 0.2), (0.42, 0.22, 0.8), (0.3, 0.18, 0.1))


@draws
def watering_can(b: Builder) -> None:
    """A can with a spout and a handle."""
    color: Color = (0.3, 0.55, 0.45)
    b.tube((0, -0.3, -0.2), (0.9, 0.7, 0.55), color, Material.METAL)
    b.add(Form.CYLINDER, (0, 0.0, 0.65), (0.15, 0.6, 0.1), color, tilt=(45, 0, 0))
    b.box((0, 0.85, -0.2), (0.15, 0.1, 0.5), shade_of(color, 0.8))


@draws
def foil(b: Builder) -> None:
    """A shining roll on a tube of cardboard, from which a crumpled sheet has been drawn."""
    bright: Color = (0.74, 0.78, 0.84)
    b.coin(0, (0, 0, -0.34), (0.88, 1, 0.66), bright, Material.METAL)
    for at, wide, shade in ((-0.62, 0.05, 0.5), (-0.5, 0.03, 1.4), (-0.2, 0.02, 0.6),
                            (-0.1, 0.06, 1.4), (0.3, 0.05, 0.5), (0.42, 0.04, 1.4),
                            (0.7, 0.03, 0.6)):  # fmt: skip
        b.coin(0, (at, 0, -0.34), (wide, 1.03, 0.68), shade_of(bright, shade))
    b.coin(0, (0, 0, -0.34), (1, 0.45, 0.3), (0.6, 0.44, 0.27))
    b.coin(0, (0, 0, -0.34), (1.005, 0.26, 0.17), BLACK)
    for index, shade in enumerate((1.4, 0.6, 1.3, 0.7, 1.35)):
        place = (0.02 * (index % 2), -0.8 + 0.1 * (index % 2), 0.1 + 0.2 * index)
        b.metal(place, (0.84, 0.1, 0.12), shade_of(bright, shade),
              tilt=(14 if index % 2 else -14, 0, 0))  # fmt: skip


@draws
def decor(b: Builder) -> None:
    """A tall ornament."""
    b.tube((0, -0.9, 0), (1, 0.1, 1), DARK)
    b.tube((0, 0, 0), (0.6, 0.9, 0.6), pick(CERAMICS, b.style), top=0.5)
    b.ball((0, 0.75, 0), (0.5, 0.25, 0.5), pick(CERAMICS, b.style + 1))
