"""Tables, counters, shelves and chests."""

from collections.abc import Sequence

from infthor_sim.physics.footprints import Rect
from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import CORNERS, Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import CHROME, CLOTHS, DARK, WOODS, pick

_STONES: tuple[Color, ...] = ((0.55, 0.53, 0.5), (0.35, 0.35, 0.37), (0.72, 0.69, 0.63))

# metres from a chest's front to the backs of the drawers' fronts, which procedural rooms put in it
_INSET = 0.026


@draws
def counter(b: Builder) -> None:
    """A slab of stone, cut out where sinks are; a tall box has a body of wood below it."""
    height = 2 * float(b.half[1])
    color = pick(_STONES, b.style)
    # a recorded counter is a thin space above its slab
    if height < 0.1 and b.item.support is not None:
        half = 0.018 / float(b.half[1])
        cut_slab(b, b.item.support / float(b.half[1]) - 1 - half, half, color, Material.STONE)
        return
    slab = b.thick(0.025, 1) if height > 0.08 else 1.0
    top = 1.0 if b.item.support is None else b.item.support / float(b.half[1]) - 1
    cut_slab(b, top - slab, slab, color, Material.STONE)
    if height > 0.2:
        wood = pick(WOODS, b.style)
        if b.item.hollow:
            _carcass(b, wood, top - 2 * slab)
        else:
            body = (top - 2 * slab + 1) / 2
            cut_slab(b, -1 + body, body, wood, Material.WOOD, shrink=0.96)


def cut_slab(
    b: Builder, at: float, half: float, color: Color, material: Material, shrink: float = 1.0
) -> None:
    """Add a board over the object's outline, its middle at `at`, `half` thick (fractions)."""
    turned = round(b.item.front / 90)
    x, z = float(b.half[0]), float(b.half[2])
    for piece in b.item.pieces or ((-x, -z, x, z),):
        x0, z0, x1, z1 = _turn(piece, turned) if b.item.pieces else piece
        middle = ((x0 + x1) / 2 / x, at, (z0 + z1) / 2 / z)
        b.box(
            middle, ((x1 - x0) / 2 / x * shrink, half, (z1 - z0) / 2 / z * shrink), color, material
        )


def _turn(rect: Rect, quarters: int) -> Rect:
    """Return a rectangle of the object's frame in that of its front, by quarter turns."""
    x0, z0, x1, z1 = rect
    for _ in range(quarters % 4):
        x0, z0, x1, z1 = -z1, x0, -z0, x1
    return x0, z0, x1, z1


def _carcass(b: Builder, color: Color, top: float) -> None:
    """Add sides and back from the floor up to `top`; the front is left to drawers."""
    x, z = b.sides(0.012, 0.01)
    middle = (top - 1) / 2
    half = (top + 1) / 2
    for side in (-1, 1):
        b.wood((side * (1 - x), middle, 0), (x, half, 1), shade_of(color, 0.9))
    b.wood((0, middle, -1 + z), (1 - 2 * x, half, z), shade_of(color, 0.7))


def _surface(b: Builder) -> float:
    """Return the height of the board's upper side, as a fraction of the half box."""
    return 1.0 if b.item.support is None else b.item.support / float(b.half[1]) - 1


def _top(b: Builder, color: Color, edge: float) -> float:
    """Add a board, and a back where the box is higher; return the board's lower height."""
    surface = _surface(b)
    board = b.thick(0.02, 1)
    b.wood((0, surface - board, 0), (1, board, 1), color)
    b.wood((0, surface - 1.3 * board, 0), (1.004, 0.5 * board, 1.004), shade_of(color, edge))
    if surface < 1 - b.thick(0.12, 1):
        z = b.thick(0.015, 2)
        b.wood((0, (1 + surface) / 2, -1 + z), (1, (1 - surface) / 2, z), shade_of(color, 0.85))
    return surface - 2 * board


def _legs(b: Builder, under: float, thick: float, color: Color) -> None:
    x, z = b.sides(thick, thick)
    for sx, sz in CORNERS:
        b.wood((sx * (0.97 - x), (under - 1) / 2, sz * (0.97 - z)), (x, (under + 1) / 2, z), color)


@draws
def desk(b: Builder) -> None:
    """A writing mat on a board, drawers at one end, a side at the other, a panel at the back."""
    color = pick(WOODS, b.style)
    under = _top(b, color, 0.7)
    mat = min(0.8, b.thick(0.36, 0)), min(0.62, b.thick(0.22, 2))
    # it stands out by half a millimetre: things stand on the board
    level = _surface(b) - b.thick(0.001, 1)
    b.box((0, level, 0.14), (mat[0], b.thick(0.0015, 1), mat[1]), (0.13, 0.25, 0.2))
    if b.item.hollow:
        _carcass(b, color, under)
        return
    x, z = b.sides(0.015, 0.01)
    wide = min(0.35, b.thick(0.2, 0))
    b.span((-0.98, -1, -0.94), (-0.98 + 2 * x, under, 0.94), shade_of(color, 0.85), Material.WOOD)
    b.span(
        (-0.98 + 2 * x, -0.2, -0.9),
        (0.98 - 2 * wide, under, -0.9 + 2 * z),
        shade_of(color, 0.75),
        Material.WOOD,
    )
    b.span(
        (0.98 - 2 * wide, -0.94, -0.94), (0.98, under, 0.92), shade_of(color, 0.8), Material.WOOD
    )
    rise = (under + 0.94) / 3
    for row in range(3):
        low = -0.94 + rise * row
        b.span((0.98 - 1.9 * wide, low + 0.03, 0.92), (0.98 - 0.1 * wide, low + rise - 0.03, 0.95),
               shade_of(color, 1.12), Material.WOOD)  # fmt: skip
        b.metal(
            (0.98 - wide, low + rise * 0.6, 0.965), (wide * 0.3, b.thick(0.008, 1), 0.02), CHROME
        )


@draws
def dining_table(b: Builder) -> None:
    """A large board on turned, slender-footed legs, a deep apron, and a runner of cloth."""
    color = shade_of(pick(WOODS, b.style + 2), 1.05)
    under = _top(b, color, 0.6)
    if b.item.hollow:
        _carcass(b, color, under)
        return
    runner = pick(CLOTHS, b.style)
    # half a millimetre above the board
    level = _surface(b) - b.thick(0.001, 1)
    half = b.thick(0.0015, 1)
    b.cloth((0, level, 0), b.lengthwise(0.999, half, 0.3), runner)
    b.cloth((0, level, 0), b.lengthwise(0.9, half * 1.3, 0.22), shade_of(runner, 1.3))
    leg = shade_of(color, 0.78)
    x, z = b.sides(0.05, 0.05)
    low = -1 + b.thick(0.05, 1)
    neck = under - b.thick(0.12, 1)
    for sx, sz in CORNERS:
        at_x = sx * (0.94 - x)
        at_z = sz * (0.94 - z)
        b.wood((at_x, (under + neck) / 2, at_z), (x, (under - neck) / 2, z), leg)
        b.tube(
            (at_x, (neck + low) / 2, at_z),
            (x, (neck - low) / 2, z),
            leg,
            Material.WOOD,
            bottom=0.55,
            top=0.95,
        )
        b.ball((at_x, low, at_z), (x * 0.8, b.thick(0.05, 1), z * 0.8), shade_of(leg, 0.85))
    apron = b.thick(0.05, 1)
    b.wood((0, under - apron, 0), (0.9, apron, 0.88), shade_of(color, 0.85))


@draws
def side_table(b: Builder) -> None:
    """A small stand: a drawer's front with a knob, slim legs, a shelf near the floor."""
    color = pick(WOODS, b.style)
    under = _top(b, color, 0.7)
    if b.item.hollow:
        _carcass(b, color, under)
        return
    _legs(b, under, 0.018, shade_of(color, 0.85))
    half = min(b.thick(0.07, 1), (under + 1) / 4)
    b.wood((0, under - half, 0), (0.93, half, 0.93), shade_of(color, 0.8))
    b.wood((0, under - half, 0.94), (0.8, half * 0.8, 0.02), shade_of(color, 1.12))
    b.ball((0, under - half, 0.98), b.extent(0.016, 0.016, 0.016), CHROME)
    b.wood((0, -0.72, 0), (0.92, b.thick(0.01, 1), 0.92), shade_of(color, 0.9))


@draws
def coffee_table(b: Builder) -> None:
    """A low board on stout legs with a shelf between them."""
    color = pick(WOODS, b.style)
    under = _top(b, color, 0.7)
    if b.item.hollow:
        _carcass(b, color, under)
        return
    _legs(b, under, 0.035, shade_of(color, 0.8))
    b.wood((0, -0.55, 0), (0.93, b.thick(0.01, 1), 0.9), shade_of(color, 0.9))


@draws
def chest(b: Builder) -> None:
    """A closed body with a board on top: dressers and stands whose drawers are no objects."""
    color = pick(WOODS, b.style)
    board = b.thick(0.02, 1)
    top = _surface(b)
    b.wood((0, top - board, 0), (1, board, 1), color)
    if b.item.hollow:
        _carcass(b, color, top - 2 * board)
        if not b.item.asset_id:
            _drawer_frame(b, shade_of(color, 0.85), top - 2 * board)
        return
    middle = (top - 2 * board - 1) / 2
    half = (top - 2 * board + 1) / 2
    b.wood((0, middle, -0.02), (0.97, half, 0.95), shade_of(color, 0.85))
    for row in range(3):
        level = middle + half * (0.6 - row * 0.6)
        for side in (-1, 1):
            b.wood((side * 0.48, level, 0.96), (0.45, 0.26, 0.03), color)
            b.ball((side * 0.48, level, 1.0), b.extent(0.015, 0.015, 0.015), CHROME)


def _drawer_frame(b: Builder, color: Color, top: float) -> None:
    """Add what is seen between the fronts of two columns of drawers, and above them."""
    front = 1 - b.thick(_INSET, 2)
    post = b.thick(0.017, 0)
    b.span((-post, -1, front - b.thick(0.02, 2)), (post, top, front), color, Material.WOOD)
    rail = top - b.thick(0.037, 1) * 2
    b.span((-1, rail, front - b.thick(0.02, 2)), (1, top, front), color, Material.WOOD)


@draws
def shelf(b: Builder) -> None:
    """A board at the foot of the space that things stand in."""
    color = pick(WOODS, b.style // 3)
    height = 2 * float(b.half[1])
    thick = min(0.01, max(height / 2, 0.004))
    b.slab((0, -1 - thick / max(float(b.half[1]), 1e-6) + 0.002, 0),
           (float(b.half[0]), thick, float(b.half[2])), color,
           Material.WOOD)  # fmt: skip


@draws
def shelving(b: Builder) -> None:
    """An open rack on posts."""
    color = pick(WOODS, b.style)
    x, y, z = b.extent(0.015, 0.01, 0.015)
    for side_x, side_z in CORNERS:
        b.wood((side_x * (1 - x), 0, side_z * (1 - z)), (x, 1, z), color)
    levels: Sequence[float] = (-0.9, 1 - y) if b.item.hollow else (-0.9, -0.3, 0.3, 1 - y)
    for level in levels:
        b.wood((0, level, 0), (1, y, 1), shade_of(color, 0.95))


@draws
def cart(b: Builder) -> None:
    """Two trays on wheels."""
    for level in (-0.5, 0.94):
        b.metal((0, level, 0), (1, 0.06, 1), (0.75, 0.77, 0.8))
    for sx, sz in CORNERS:
        b.metal((sx * 0.94, 0, sz * 0.94), (0.04, 0.98, 0.04), CHROME)
        b.ball((sx * 0.94, -0.95, sz * 0.94), (0.08, 0.06, 0.08), DARK)
