"""Fixtures of rooms: sinks, taps, baths, toilets, windows, pictures, switches, stoves, rails."""

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import (
    BLACK,
    BRASS,
    CHROME,
    CLOTHS,
    DARK,
    FLOORS,
    GLASS,
    LEAF,
    STEEL,
    WHITE,
    WOODS,
    pick,
)
from infthor_sim.render.shapes.tables import cut_slab
from infthor_sim.world import FLOOR_STYLES

_CERAMIC: Color = (0.95, 0.95, 0.93)
_SKY: Color = (0.66, 0.83, 0.97)
_WATER: Color = (0.55, 0.75, 0.9)


@draws
def floor(b: Builder) -> None:
    """The floor of a room; its style is an index of `FLOORS`."""
    cut_slab(b, 0.0, 1.0, *FLOORS[FLOOR_STYLES[b.style % len(FLOOR_STYLES)]])


@draws
def sink(b: Builder) -> None:
    """A rim of steel or ceramic around the basins; a hollow tub if they are no objects."""
    color = STEEL if b.style % 2 else _CERAMIC
    if not b.item.pieces:
        b.open_top(color, Material.METAL, 0.02, b.floor, glow=0.22)
        return
    rim = b.thick(0.008, 1)
    cut_slab(b, 1 - rim, rim, color, Material.METAL)


@draws
def sink_basin(b: Builder) -> None:
    """A basin of steel or ceramic."""
    _basin(b, steel=b.style % 2 == 1)


@draws
def bathtub_basin(b: Builder) -> None:
    """A basin of ceramic."""
    _basin(b, steel=False)


def _basin(b: Builder, steel: bool) -> None:
    """A tub with a drain."""
    color = shade_of(STEEL, 1.12) if steel else _CERAMIC
    b.open_top(color, Material.METAL if steel else Material.PLAIN, 0.014, b.floor, glow=0.22)
    level = b.floor - b.thick(0.001, 1)
    b.tube((0, level, 0), b.extent(0.04, 0.0015, 0.04), CHROME, Material.METAL)
    b.tube((0, level, 0), b.extent(0.028, 0.002, 0.028), DARK)


@draws
def faucet(b: Builder) -> None:
    """A tap: a post, a spout to the front, two handles; water falls while it is on."""
    r = 0.014
    b.rod((0, 0, -0.7), r, float(b.half[1]) * 0.95, 1, CHROME)
    b.rod((0, 0.9, 0.05), r * 0.8, float(b.half[2]) * 0.85, 2, CHROME)
    b.rod((0, 0.7, 0.85), r * 0.7, float(b.half[1]) * 0.2, 1, CHROME)
    for side in (-1, 1):
        b.tube((side * 0.75, -0.75, -0.7), (0.2, 0.25, b.thick(0.02, 2)), CHROME, Material.METAL)
    b.metal((0, -0.93, -0.7), (1, 0.07, min(0.3, b.thick(0.03, 2))), CHROME)
    if b.state.toggled:
        b.rod((0, -0.35, 0.85), 0.008, float(b.half[1]) * 0.9, 1, _WATER)


@draws
def bathtub(b: Builder) -> None:
    """A white tub; its basin may be a separate object."""
    b.open_top(_CERAMIC, Material.PLAIN, 0.07, b.level(0.008), glow=0.15)


@draws
def toilet(b: Builder) -> None:
    """A bowl in front of a tank."""
    b.box((0, 0.45, -0.72), (0.95, 0.55, 0.28), _CERAMIC)
    b.box((0, 0.95, -0.72), (1.0, 0.05, 0.28), shade_of(_CERAMIC, 0.96))
    b.tube((0, -0.55, 0.1), (0.55, 0.45, 0.6), _CERAMIC, bottom=0.75)
    b.tube((0, -0.2, 0.25), (0.85, 0.1, 0.75), shade_of(_CERAMIC, 0.98))
    lid = 0.02
    if b.state.openness > 0:
        b.tube((0, -0.08, 0.25), (0.5, 0.02, 0.45), (0.55, 0.7, 0.8))
        b.box((0, 0.35, -0.4), (0.8, 0.45, 0.04), shade_of(_CERAMIC, 0.97))
    else:
        b.tube((0, -0.07, 0.25), (0.85, lid, 0.75), WHITE)
    b.metal((-0.7, 0.6, -0.42), (0.12, 0.03, 0.03), CHROME)


@draws
def window(b: Builder) -> None:
    """A bright pane in a white frame with a cross, at the wall side of its box."""
    x, y, z = b.extent(0.03, 0.03, 0.05)
    at = z - 1
    b.box((0, 0, at), (1 - x, 1 - y, z * 0.85), _SKY, Material.GLASS, glow=0.8)
    for side in (-1, 1):
        b.box((side * (1 - x), 0, at), (x, 1, z), WHITE)
        b.box((0, side * (1 - y), at), (1, y, z), WHITE)
    b.box((0, 0, at), (x * 0.6, 1, z * 0.95), WHITE)
    b.box((0, 0, at), (1, y * 0.6, z * 0.95), WHITE)
    if b.state.broken:
        b.box((0.2, 0.3, at), (0.5, 0.02, z), BLACK, tilt=(0, 0, 40))


@draws
def curtains(b: Builder) -> None:
    """Cloth in folds on a rail."""
    color = pick(CLOTHS, b.style)
    for index in range(8):
        at = -0.875 + 0.25 * index
        b.tube(
            (at, -0.03, 0),
            (0.14, 0.97, 0.7),
            shade_of(color, 0.9 + 0.15 * (index % 2)),
            Material.FABRIC,
        )
    b.rod((0, 0.97, 0), 0.012, float(b.half[0]), 0, BRASS)


@draws
def blinds(b: Builder) -> None:
    """Slats: a bundle at the top when closed, let down when open, as in AI2-THOR."""
    count = max(3, round(float(b.half[1]) / 0.06))
    for index in range(count):
        b.box((0, 0.95 - index * 1.9 / count, 0), (1, 0.75 / count, 0.6), (0.9, 0.88, 0.82))


@draws
def painting(b: Builder) -> None:
    """A framed picture: hills, a ship at sea, flowers in a vase, or coloured squares."""
    x, y = b.thick(0.04, 0), b.thick(0.04, 1)
    b.wood((0, 0, -0.2), (1, 1, 0.8), pick((*WOODS, BLACK, BRASS), b.style))
    sky = pick(((0.7, 0.8, 0.9), (0.9, 0.75, 0.55), (0.6, 0.65, 0.8), (0.93, 0.9, 0.82)), b.style)
    b.box((0, 0, 0.3), (1 - x, 1 - y, 0.55), sky)
    _MOTIFS[b.style // 3 % len(_MOTIFS)](b, 1 - x, 1 - y)


def _hills(b: Builder, x: float, y: float) -> None:
    land = pick(((0.35, 0.5, 0.3), (0.5, 0.35, 0.25)), b.style)
    b.box((0, -0.9 * y + 0.4, 0.35), (x * 0.99, 0.4, 0.55), land)
    b.ball((0.35, 0.4, 0.85), (0.15, 0.15 * float(b.half[0] / b.half[1]), 0.06), (0.95, 0.85, 0.4))


def _ship(b: Builder, x: float, y: float) -> None:
    b.box((0, -0.9 * y + 0.25, 0.35), (x * 0.99, 0.25, 0.55), (0.15, 0.35, 0.5))
    b.box((0.05, -0.32, 0.4), (0.42, 0.09, 0.55), (0.4, 0.2, 0.12))
    b.box((0.05, 0.1, 0.4), (0.02, 0.36, 0.53), BLACK)
    for side, height in ((0.24, 0.3), (-0.14, 0.22)):
        b.box((side, 0.05, 0.4), (0.15, height, 0.54), WHITE)


def _flowers(b: Builder, x: float, y: float) -> None:
    b.box((0, -0.6 * y, 0.4), (0.24, 0.4 * y, 0.52), pick(CLOTHS, b.style))
    red = pick(((0.85, 0.25, 0.3), (0.95, 0.75, 0.2), (0.6, 0.4, 0.75)), b.style)
    for aside, up, shade in ((-0.4, 0.2, 0.8), (0, 0.5, 1.0), (0.4, 0.15, 1.2), (0.05, 0.05, 0.9)):
        b.box((aside * x / 2, up / 2 - 0.15, 0.36), (0.02, 0.3, 0.52), LEAF)
        half = (0.2, 0.2 * float(b.half[0] / b.half[1]), 0.52)
        b.coin(2, (aside * x, up, 0.42), half, shade_of(red, shade))


def _squares(b: Builder, x: float, y: float) -> None:
    for index in range(6):
        color = pick(((0.8, 0.2, 0.15), (0.15, 0.25, 0.6), (0.95, 0.8, 0.2), DARK), b.style + index)
        at = (x * (index % 3 - 1) * 0.62, y * (index // 3 - 0.5) * 0.95, 0.4)
        b.box(at, (x * 0.25, y * 0.38, 0.53), color)


_MOTIFS = (_hills, _ship, _flowers, _squares)


@draws
def mirror(b: Builder) -> None:
    """A shiny plate in a frame."""
    b.metal((0, 0, -0.3), (1, 1, 0.7), STEEL)
    color: Color = (0.5, 0.45, 0.35) if b.state.dirty else (0.78, 0.86, 0.9)
    b.box((0, 0, 0.3), (1 - b.thick(0.02, 0), 1 - b.thick(0.02, 1), 0.6), color, Material.GLASS)
    if b.state.broken:
        b.box((0, 0.1, 0.9), (0.7, 0.01, 0.05), BLACK, tilt=(0, 0, 35))


@draws
def light_switch(b: Builder) -> None:
    """A plate with a rocker."""
    b.box((0, 0, -0.2), (1, 1, 0.8), WHITE)
    up = 0.3 if b.state.toggled else -0.3
    b.box((0, up, 0.5), (0.4, 0.35, 0.5), (0.75, 0.75, 0.72))


@draws
def burner(b: Builder) -> None:
    """A ring on the stove, glowing while it is on."""
    hot = b.state.toggled
    b.tube((0, 0, 0), (1, 1, 1), (0.9, 0.3, 0.1) if hot else DARK, glow=0.8 if hot else 0.0)
    b.tube((0, 0.2, 0), (0.62, 1, 0.62), BLACK)
    b.tube(
        (0, 0.4, 0), (0.35, 1, 0.35), (1.0, 0.45, 0.15) if hot else DARK, glow=0.8 if hot else 0.0
    )


@draws
def knob(b: Builder) -> None:
    """A round knob with a mark."""
    b.add(Form.CYLINDER, (0, 0, 0), (1, 1, 1), DARK, tilt=(90, 0, 0))
    turn = 90.0 if b.state.toggled else 0.0
    b.add(Form.BOX, (0, 0, 0.95), (0.12, 0.9, 0.1), WHITE, tilt=(0, 0, turn))


@draws
def shower_head(b: Builder) -> None:
    """A pipe with a rose; drops fall while it is on."""
    b.rod((0, -0.1, -0.8), 0.012, float(b.half[1]) * 0.9, 1, CHROME)
    b.rod((0, 0.85, -0.1), 0.012, float(b.half[2]) * 0.7, 2, CHROME)
    b.tube((0, 0.75, 0.5), (0.6, 0.05, 0.5), CHROME, Material.METAL, top=0.5)
    if b.state.toggled:
        for x, z in ((-0.3, 0.4), (0.3, 0.4), (0.0, 0.7), (0.0, 0.2)):
            b.rod((x, -0.1, z), 0.005, float(b.half[1]) * 0.8, 1, _WATER)


@draws
def shower_glass(b: Builder) -> None:
    """A frame around a pane that one sees through: only its edges are drawn."""
    x, y, z = b.extent(0.012, 0.012, 0.012)
    flat = 0 if b.half[0] < b.half[2] else 2
    for side in (-1, 1):
        if flat == 0:
            b.metal((0, 0, side * (1 - z)), (min(1.0, x * 2), 1, z), CHROME)
            b.metal((0, side * (1 - y), 0), (min(1.0, x * 2), y, 1), CHROME)
        else:
            b.metal((side * (1 - x), 0, 0), (x, 1, min(1.0, z * 2)), CHROME)
            b.metal((0, side * (1 - y), 0), (1, y, min(1.0, z * 2)), CHROME)


@draws
def shower_door(b: Builder) -> None:
    """The framed door of a shower, swung out when open, with a grip."""
    shower_glass(b)
    b.box(
        (0, 0, 0.6) if b.half[0] < b.half[2] else (0.6, 0, 0),
        (b.thick(0.02, 0), 0.12, b.thick(0.02, 2)),
        GLASS,
    )


@draws
def shower_curtain(b: Builder) -> None:
    """A curtain on a rail: gathered when closed, drawn out when open, as in AI2-THOR."""
    color = pick(CLOTHS, b.style + 2)
    long = 0 if b.half[0] >= b.half[2] else 2
    for index in range(6):
        at = -1 + (2 * index + 1) / 6
        fold = shade_of(color, 0.95 + 0.1 * (index % 2))
        b.tube(b.lengthwise(at, 0, 0), b.lengthwise(0.2, 1, 0.5), fold, Material.FABRIC)
    b.rod((0, 0.99, 0), 0.012, float(b.half[long]), long, CHROME)


@draws
def rail(b: Builder) -> None:
    """A bar that a towel hangs on."""
    b.rod((0, 0, 0.5), 0.01, float(b.half[0]), 0, CHROME)
    for side in (-1, 1):
        b.metal((side * 0.92, 0, -0.2), (0.06, 0.9, 0.8), CHROME)


@draws
def towel_hook(b: Builder) -> None:
    """A plate on the wall from which a short bar hangs."""
    b.metal((0, 0.55, -0.7), (0.35, 0.45, 0.3), CHROME)
    level = b.level(0.055)
    b.rod((0, level, 0.5), 0.008, float(b.half[0]), 0, CHROME)
    b.span((-0.06, level, 0.35), (0.06, 0.6, 0.65), CHROME, Material.METAL)
    b.span((-0.06, 0.45, -0.5), (0.06, 0.6, 0.65), CHROME, Material.METAL)


@draws
def paper_hanger(b: Builder) -> None:
    """A holder for a roll of paper."""
    b.rod((0, 0, 0.5), 0.012, float(b.half[0]), 0, CHROME)
    b.metal((0, 0, -0.8), (0.9, 0.8, 0.2), CHROME)


@draws
def doorframe(b: Builder) -> None:
    """The frame of a doorway."""
    x, y = b.thick(0.05, 0), b.thick(0.05, 1)
    for side in (-1, 1):
        b.box((side * (1 - x), 0, 0), (x, 1, 1), WHITE)
    b.box((0, 1 - y, 0), (1, y, 1), WHITE)
