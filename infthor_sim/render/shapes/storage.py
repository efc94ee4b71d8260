"""Doors, and objects with an inside: cabinets, drawers, fridges, microwaves, safes, boxes, bins."""

from infthor_sim.objects import DOOR_SWING, DRAWER_SLIDE, WALL
from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.fixtures import doorframe
from infthor_sim.render.shapes.palette import BLACK, CHROME, DARK, STEEL, WHITE, WOODS, pick

_LEAF = 0.02  # thickness of a door, metres
# metres that a fridge's grips stand out within its box, as recorded in FloorPlan28
_FRIDGE_GRIP = 0.022
_LIT = 0.2  # glow of the insides of open things: their contents would be hard to see otherwise
# of a wide open cardboard box's width; the rest is its flaps. The type's `unfolds` has the same
# share.
_BODY = 0.82
_TRAY = 0.9  # top of a drawer's sides, in fractions: a little lower than its front
_COLD: Color = (0.93, 0.97, 1.0)
_TINTED: Color = (0.55, 0.76, 0.84)
_BOLT: Color = (0.82, 0.84, 0.86)
_WINDOW: Color = (0.13, 0.14, 0.16)
# Of a fridge's shelves, in fractions: one looks down between glass and rim onto the lower ones, as
# through clear glass.
_GLASS_END = 0.3
_RIM = 0.76
# On a fridge's sides: height, place along and colour.
_NOTES: tuple[tuple[float, float, Color], ...] = (
    (0.45, -0.2, (0.97, 0.93, 0.6)), (0.52, 0.25, (0.95, 0.95, 0.93)),
    (0.2, 0.1, (0.7, 0.86, 0.93)),
)  # fmt: skip
_MAGNET: Color = (0.8, 0.15, 0.15)


def _door(
    b: Builder,
    color: Color,
    material: Material,
    grip: Color,
    low: float = -1.0,
    high: float = 1.0,
    grip_in: float = 0.0,
    side: int = 0,
    share: float = 1.0,
) -> None:
    """Add a hinged door over the front, from height fraction `low` to `high`, as open as it is.

    With `grip_in`, the grip is within the object's box, and the door so many metres behind its
    front. It hangs at `side`, -1 or 1, else at the object's own, over a share of the width.
    """
    side = side or b.item.leaf_sides[0]
    width, height, depth = map(float, b.half * (share, 1.0, 1.0))
    middle = (low + high) / 2 * height
    half = (high - low) / 2 * height
    angle = side * DOOR_SWING * b.state.openness
    leaf = min(_LEAF / 2, depth * 0.3)
    hinge = (side, 0.0, 1.0)
    back = -leaf - grip_in
    b.hinged_box(
        hinge,
        (-side * width, middle, back),
        (width * 0.985, half * 0.985, leaf),
        angle,
        color,
        material,
    )
    reach = 2 * width * (0.94 if grip_in else 0.88)
    tall = min(half * 0.35, 0.2)
    b.hinged_box(
        hinge,
        (-side * reach, middle, 0.01 - grip_in),
        (0.008, tall, 0.01),
        angle,
        grip,
        Material.METAL,
    )


@draws
def doorway(b: Builder) -> None:
    """A doorway with its door, of two leaves if it is wide."""
    doorframe(b)
    sides = b.item.leaf_sides
    for side in sides:
        _door(b, pick(WOODS, b.style), Material.WOOD, CHROME, high=0.97, side=side,
              share=1 / len(sides))  # fmt: skip


@draws
def cabinet(b: Builder) -> None:
    """A cupboard of wood with one door."""
    color = pick(WOODS, b.style // 7 if b.item.asset_id else 2)
    if b.state.openness > 0:
        b.open_front(shade_of(color, 0.8), shade_of(color, 1.2), Material.WOOD, b.item.floors[0],
                     glow=_LIT,
                     top=not b.item.hollow)  # fmt: skip
    elif not b.item.hollow:
        back = b.thick(_LEAF, 2)
        b.wood((0, 0, -back / 2), (1, 1, 1 - back / 2), shade_of(color, 0.8))
    else:  # nothing but a panel behind the door, so that the wall is not seen past its edges
        leaf = b.thick(_LEAF, 2)
        b.span((-1, -1, 1 - 1.4 * leaf), (1, 1, 1 - leaf), shade_of(color, 0.8), Material.WOOD)
    _door(b, color, Material.WOOD, CHROME)


@draws
def drawer(b: Builder) -> None:
    """A drawer: its front, and when open the tray behind it, as wide as what may lie in it."""
    color = shade_of(pick(WOODS, 2), 1.05)
    out = 2 * DRAWER_SLIDE * b.state.openness
    leaf = b.thick(_LEAF / 2, 2)
    if b.state.openness > 0:
        x = b.thick(WALL, 0)
        gap = b.thick(0.004, 0)
        back = out - 1 + b.thick(WALL, 2)
        side = shade_of(color, 1.1)
        floor = b.floor
        front = out + 1 - 2 * leaf
        b.span((gap - 1, -0.96, out - 1), (1 - gap, floor, front), shade_of(color, 1.3), glow=_LIT)
        b.span((gap - 1, floor, out - 1), (1 - gap, _TRAY, back), side, Material.WOOD, glow=_LIT)
        b.span((gap - 1, floor, back), (x - 1, _TRAY, front), side, Material.WOOD, glow=_LIT)
        b.span((1 - x, floor, back), (1 - gap, _TRAY, front), side, Material.WOOD, glow=_LIT)
    else:
        b.wood((0, 0, -leaf), (0.94, 0.92, 1 - leaf), shade_of(color, 0.75))
    b.wood((0, 0, out + 1 - leaf), (0.985, 0.96, leaf), color)
    b.rod(
        (0, 0.25, out + 1 + 0.012 / max(float(b.half[2]), 0.01)),
        0.006,
        min(float(b.half[0]) * 0.4, 0.08),
        0,
        CHROME,
    )


@draws
def fridge(b: Builder) -> None:
    """A fridge: a freezer door above, a tall door below, each with a grip."""
    color = (WHITE, STEEL, (0.86, 0.87, 0.88))[b.style % 3]
    if b.state.openness == 0:
        z = b.thick(0.025, 2)
        b.metal((0, 0, -z), (1, 1, 1 - z), shade_of(color, 0.92))
    else:
        _lit_inside(b, shade_of(color, 0.92))
    _door(b, color, Material.METAL, DARK, -0.97, 0.3, _FRIDGE_GRIP)
    _door(b, shade_of(color, 1.03), Material.METAL, DARK, 0.33, 1.0, _FRIDGE_GRIP)
    _fridge_sides(b)
    if b.state.openness > 0:
        _door_racks(b)


def _fridge_sides(b: Builder) -> None:
    """What tells a fridge from the side: the seals behind its doors, a dark foot, notes."""
    x, z = b.sides(0.004, 0.006)
    seal = 1 - b.thick(_FRIDGE_GRIP + _LEAF, 2) - z
    for side in (-1, 1):
        if b.state.openness == 0:
            b.box((side, -0.335, seal), (x, 0.635, z), BLACK)
            b.box((side, 0.665, seal), (x, 0.335, z), BLACK)
            b.span((side - x, 0.3, seal), (side + x, 0.33, 1), BLACK)
        b.span((side - x, -1, -0.98), (side + x, -0.94, seal), BLACK)
        for index, (up, along, color) in enumerate(_NOTES):
            at = (side * 1.0, up, side * along)
            b.box(at, (x, 0.085 - 0.02 * (index % 2), b.thick(0.1, 2)), color, Material.PAPER)
            b.box((side, up + 0.08, side * along), (1.6 * x, 0.014, b.thick(0.02, 2)), _MAGNET)


def _lit_inside(b: Builder, outside: Color) -> None:
    """The body of an open fridge: white and bright within, shelves of tinted glass, a lamp."""
    b.open_front(outside, _COLD, Material.METAL, WALL, glow=0.45)
    x, y = 1 - b.thick(WALL, 0), b.thick(0.008, 1)
    back = b.thick(WALL, 2) - 1
    edge = b.thick(0.012, 0)
    rim = shade_of(_TINTED, 0.62)
    middle = (_RIM + _GLASS_END) / 2
    half = (_RIM - _GLASS_END) / 2
    for metres in b.item.floors:
        level = b.level(metres)
        b.span((-x, level - y, back), (x, level, _GLASS_END), _TINTED, Material.GLASS, glow=0.3)
        b.span((-x, level - 2 * y, _RIM), (x, level, _RIM + 0.06), rim, glow=0.2)
        for side in (-1, 1):
            b.box((side * (x - edge), level - y, middle), (edge, y, half), rim, glow=0.2)
    b.box((0, 0.9, -0.2), (0.3, 0.02, 0.3), (1.0, 1.0, 0.9), glow=0.9)


def _door_racks(b: Builder) -> None:
    """The white inner side of the open doors, with racks."""
    side = b.item.hinge or -1
    angle = side * DOOR_SWING * b.state.openness
    width, height, _ = map(float, b.half)
    hinge = (side, 0.0, 1.0)
    inward = -_LEAF - _FRIDGE_GRIP
    for low, high in ((-0.93, 0.26), (0.37, 0.96)):
        half = (high - low) / 2 * height
        middle = (high + low) / 2 * height
        b.hinged_box(hinge, (-side * width, middle, inward - 0.006), (width * 0.9, half, 0.006),
                     angle, _COLD,
                Material.PLAIN, glow=0.3)  # fmt: skip
        for share in (-0.6, 0.1):
            offset = (-side * width, middle + share * half, inward - 0.035)
            b.hinged_box(
                hinge,
                offset,
                (width * 0.8, 0.03, 0.03),
                angle,
                (0.6, 0.72, 0.8),
                Material.PLAIN,
                glow=0.15,
            )


@draws
def microwave(b: Builder) -> None:
    """A microwave oven: a dark window, a panel of keys, vents behind; lit inside while it runs."""
    body = (STEEL, DARK, WHITE)[b.style % 3]
    x, z = b.sides(0.02, 0.01)
    lit = 0.75 if b.state.toggled else 0.0
    panel = shade_of(body, 0.9)
    door = shade_of(body, 0.85)
    if b.state.openness == 0:
        b.metal((0, 0, -z), (1, 1, 1 - z), body)
        window: Color = (0.9, 0.75, 0.4) if b.state.toggled else _WINDOW
        b.metal((0.22, 0, 1 - z), (0.74, 0.92, z), door)
        b.box((0.27, 0, 1 - z / 2), (0.58, 0.68, z), window, Material.GLASS, glow=lit)
        b.metal((-0.44, 0, 1 + z), (x, 0.7, z), CHROME)
    else:
        b.open_front(body, shade_of(STEEL, 1.1), Material.METAL, b.item.floors[0], glow=0.3)
        b.tube(
            (0.2, b.floor, 0), (0.55, b.thick(0.002, 1), 0.75), (0.8, 0.86, 0.88), Material.GLASS
        )
        b.metal((-0.76, 0, 0), (0.22, 0.94, 0.98), panel)
        wide = float(b.half[0])
        high = float(b.half[1])
        angle = DOOR_SWING * b.state.openness
        b.hinged_box(
            (1, 0, 1),
            (-0.74 * wide, 0, -0.01),
            (0.74 * wide, 0.92 * high, 0.01),
            angle,
            door,
            Material.METAL,
        )
        b.hinged_box((1, 0, 1), (-0.72 * wide, 0, -0.01), (0.55 * wide, 0.65 * high, 0.012), angle,
                     _WINDOW,
                Material.GLASS)  # fmt: skip
        b.hinged_box(
            (1, 0, 1),
            (-1.44 * wide, 0, 0.01),
            (0.02, 0.7 * high, 0.01),
            angle,
            CHROME,
            Material.METAL,
        )
    _vents(b)
    b.box((-0.76, 0.1, 1 - z / 2), (0.18, 0.7, z), BLACK)
    b.box((-0.76, 0.62, 1), (0.14, 0.12, z), (0.2, 0.85, 0.45), glow=0.6)
    for row in range(3):
        b.box((-0.76, 0.25 - 0.25 * row, 1), (0.12, 0.07, z), (0.55, 0.56, 0.58))


def _vents(b: Builder) -> None:
    """Dark slots, a plate of data and the root of the cord on the back, and slots on both sides."""
    x, z = b.sides(0.003, 0.003)
    for level in (0.6, 0.28, -0.04):
        b.box((0.35, level, -1), (0.5, 0.09, z), BLACK)
        for side in (-1, 1):
            b.box((side, level, -0.4), (x, 0.09, 0.36), BLACK)
    b.box((-0.55, 0.3, -1), (0.24, 0.3, z), (0.75, 0.77, 0.8), Material.PAPER)
    b.ball((-0.6, -0.7, -1), (0.1, 0.14, 4 * z), DARK)


@draws
def safe(b: Builder) -> None:
    """A strongbox with bands and bolts on all sides; its door has a wheel, a dial and keys."""
    body: Color = (0.3, 0.32, 0.35)
    if b.state.openness == 0:
        z = b.thick(0.02, 2)
        b.metal((0, 0, -z), (1, 1, 1 - z), body)
    else:
        b.open_front(body, shade_of(body, 1.7), Material.METAL, b.item.floors[0], glow=_LIT)
    _bands(b, shade_of(body, 1.7))
    _door(b, shade_of(body, 1.25), Material.METAL, CHROME)
    for level in (-0.55, 0.55):
        hinge = (b.item.leaf_sides[0], level, 1 - b.thick(0.03, 2))
        b.tube(hinge, (b.thick(0.019, 0), 0.2, b.thick(0.019, 2)), CHROME, Material.METAL)
    if b.state.openness == 0:
        out = 1 + b.thick(0.007, 2)
        b.rod((-0.3, 0.2, out), 0.015, 0.007, 2, CHROME)
        for turn in (0, 60, 120):
            b.add(Form.BOX, (-0.3, 0.2, out + b.thick(0.006, 2)), (0.3, 0.025, b.thick(0.006, 2)),
                  CHROME, Material.METAL, tilt=(0, 0, turn))  # fmt: skip
        b.coin(2, (0.35, 0.4, 1), (0.28, 0.28, b.thick(0.008, 2)), DARK)
        b.coin(2, (0.35, 0.4, 1), (0.13, 0.13, b.thick(0.016, 2)), CHROME, Material.METAL)
        b.box((0.35, 0.6, 1), (0.02, 0.06, b.thick(0.009, 2)), WHITE)
        b.box((0.35, -0.3, 1), (0.3, 0.28, b.thick(0.006, 2)), (0.1, 0.1, 0.11))
        for row in range(3):
            at = (0.35, -0.12 - 0.18 * row, 1)
            b.box(at, (0.22, 0.05, b.thick(0.009, 2)), (0.75, 0.78, 0.8))


def _bands(b: Builder, color: Color) -> None:
    """Steel bands up the sides and along the edges of back and sides, with bolts."""
    x, y, z = b.extent(0.004, 0.004, 0.004)
    front = 1 - b.thick(0.04, 2)
    for level in (-0.86, 0.86):
        b.span((-1 - x, level - 0.14, -1 - z), (1 + x, level + 0.14, -1), color, Material.METAL)
        for side in (-1, 1):
            b.metal((side, level, (front - 1) / 2), (x, 0.14, (front + 1) / 2), color)
            b.metal((side * 0.86, 0, -1), (0.14, 0.86, z), color)
            b.ball((side, level, -0.86), (3 * x, 0.06, 0.06), _BOLT)
            b.ball((side * 0.86, level, -1), (0.06, 0.06, 3 * z), _BOLT)
    b.metal((0, 1, (front - 1) / 2), (0.14, y, (front + 1) / 2), color)


@draws
def carton(b: Builder) -> None:
    """A cardboard box, its flaps spread when open."""
    color: Color = (0.72, 0.55, 0.35)
    if b.state.openness == 0:
        b.box((0, 0, 0), (1, 1, 1), color)
        b.box((0, 1, 0), (1.003, 0.01, 0.12), (0.88, 0.78, 0.58))
        b.box((0, 0.8, 0), (1.006, 0.2, 0.12), (0.88, 0.78, 0.58))
        b.box((0.1, -0.1, 1.0), (0.4, 0.25, 0.01), (0.92, 0.9, 0.85), Material.PAPER)
        return
    body = _BODY / (_BODY + (1 - _BODY) * b.state.openness)  # of the box as it is now
    _body(b, color, body)
    _flaps(b, shade_of(color, 1.16), body)


def _body(b: Builder, color: Color, share: float) -> None:
    """Add four sides and a bottom, within the share of the box that the flaps leave."""
    x, z = b.sides(0.006, 0.006)
    b.span((-share, -1, -share), (share, b.floor, share), shade_of(color, 0.88), glow=0.12)
    for side in (-1, 1):
        b.box((side * (share - x), 0, 0), (x, 1, share), color, glow=0.12)
        b.box((0, 0, side * (share - z)), (share - 2 * x, 1, z), color, glow=0.12)


def _flaps(b: Builder, color: Color, share: float) -> None:
    """Four flaps that hang outwards from the rim, to the edges of the box."""
    for axis in (0, 2):
        out = (1 - share) * float(b.half[axis])  # metres
        length = 2.2 * out
        drop = 1.96 * out
        half = [share, 0.005 / float(b.half[1]), share]
        half[axis] = length / 2 / float(b.half[axis])
        lean = 63.0
        for side in (-1, 1):
            at = b.along(side * (1 + share) / 2, axis)
            tilt = (side * lean, 0.0, 0.0) if axis == 2 else (0.0, 0.0, -side * lean)
            b.box((at[0], 1 - drop / 2 / float(b.half[1]), at[2]), half, color, tilt=tilt)


@draws
def garbage_can(b: Builder) -> None:
    """A garbage can."""
    color = ((0.35, 0.38, 0.4), (0.75, 0.76, 0.78), (0.3, 0.42, 0.36), (0.2, 0.2, 0.22))[
        b.style % 4
    ]
    b.cup((0, 0, 0), (1, 1, 1), color, Material.METAL, bottom=0.82, top=1.0)
    b.tube((0, (b.floor - 1) / 2, 0), (0.82, (b.floor + 1) / 2, 0.82), shade_of(color, 0.5))


@draws
def bag(b: Builder) -> None:
    """A tied garbage bag."""
    b.ball((0, -0.15, 0), (1, 0.85, 1), (0.12, 0.12, 0.14), Material.METAL)
    b.tube((0, 0.8, 0), (0.2, 0.2, 0.2), (0.1, 0.1, 0.12), bottom=0.5)


@draws
def hamper(b: Builder) -> None:
    """A laundry basket."""
    if b.state.openness == 0:
        b.tube((0, 0, 0), (1, 1, 1), (0.72, 0.6, 0.42), Material.FABRIC, bottom=0.88)
        return
    b.cup((0, 0, 0), (1, 1, 1), (0.72, 0.6, 0.42), Material.FABRIC, bottom=0.88)
    b.tube(
        (0, (b.floor - 1) / 2, 0),
        (0.88, (b.floor + 1) / 2, 0.88),
        (0.55, 0.45, 0.32),
        Material.FABRIC,
    )
