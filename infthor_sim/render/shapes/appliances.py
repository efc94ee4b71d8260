"""Machines, screens and lamps."""

from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import BLACK, BRASS, CHROME, DARK, STEEL, WHITE, pick

_SCREEN: Color = (0.35, 0.6, 0.9)
_ICONS: tuple[Color, ...] = (
    (0.95, 0.3, 0.25),
    (1.0, 0.85, 0.3),
    (0.35, 0.8, 0.4),
    (0.97, 0.97, 0.97),
)
_WARM: Color = (1.0, 0.93, 0.7)
_SHADES: tuple[Color, ...] = ((0.9, 0.85, 0.72), (0.75, 0.35, 0.3), (0.5, 0.6, 0.68))


@draws
def toaster(b: Builder) -> None:
    """A rounded box with two slots, glowing inside while on."""
    color = pick((STEEL, (0.7, 0.2, 0.18), WHITE), b.style)
    b.metal((0, 0, 0), (1, 0.92, 0.96), color)
    slot: Color = (1.0, 0.4, 0.1) if b.state.toggled else BLACK
    for side in (-1, 1):
        b.box(
            (side * 0.35, 0.92, 0), (0.16, 0.03, 0.75), slot, glow=0.9 if b.state.toggled else 0.0
        )
    b.box((0, 0.2, 0.98), (0.2, 0.12, 0.04), DARK)
    b.box((0, 1.0, 0), (0.02, 0.01, 0.9), shade_of(color, 0.7))


@draws
def coffee_machine(b: Builder) -> None:
    """A back with a tank, a head, a plate for the mug in front; while on, a stream and a light."""
    color = pick((BLACK, STEEL, (0.5, 0.15, 0.14)), b.style)
    b.metal((0, 0, -0.6), (0.9, 1, 0.4), color)
    b.metal((0, 0.72, 0.1), (0.9, 0.28, 0.85), shade_of(color, 1.15))
    b.box((0, 0.1, -1.0), (0.62, 0.7, 0.015), (0.5, 0.68, 0.76), Material.GLASS)
    for side in (-1, 1):
        b.box((side * 0.9, 0.1, -0.6), (0.02, 0.7, 0.22), (0.5, 0.68, 0.76), Material.GLASS)
    b.span((-0.95, -1, -0.8), (0.95, b.support, 1), DARK)
    b.tube((0, 0.36, 0.25), (0.2, 0.1, 0.2), CHROME, Material.METAL, bottom=0.5)
    lamp: Color = (0.2, 1.0, 0.3) if b.state.toggled else (0.4, 0.1, 0.1)
    b.ball((0.6, 0.72, 0.95), (0.1, 0.08, 0.06), lamp, glow=0.9 if b.state.toggled else 0.2)
    if b.state.toggled:
        b.tube((0, -0.2, 0.25), (0.05, 0.5, 0.05), (0.3, 0.17, 0.08))


@draws
def television(b: Builder) -> None:
    """A flat screen on a foot."""
    screen = _SCREEN if b.state.toggled else (0.06, 0.07, 0.09)
    z = b.thick(0.02, 2)
    b.box((0, 0.08, 0), (1, 0.9, z), BLACK)
    b.box(
        (0, 0.08, z),
        (0.96, 0.83, z * 0.2),
        screen,
        Material.GLASS,
        glow=0.85 if b.state.toggled else 0.0,
    )
    b.box((0, -0.97, 0), (0.4, 0.03, min(1.0, 6 * z)), DARK)
    b.box((0, -0.88, 0), (0.06, 0.12, z), DARK)
    if b.state.broken:
        b.box((0, 0.1, z * 1.3), (0.6, 0.01, z * 0.2), WHITE, tilt=(0, 0, 30))


@draws
def desktop(b: Builder) -> None:
    """A screen with a keyboard before it."""
    screen = _SCREEN if b.state.toggled else (0.06, 0.07, 0.09)
    b.box((0, 0.2, -0.5), (0.8, 0.75, 0.1), BLACK)
    b.box(
        (0, 0.22, -0.38),
        (0.75, 0.66, 0.03),
        screen,
        Material.GLASS,
        glow=0.85 if b.state.toggled else 0.0,
    )
    b.box((0, -0.8, -0.5), (0.08, 0.2, 0.08), DARK)
    b.box((0, -0.95, 0.6), (0.6, 0.05, 0.35), DARK)


@draws
def laptop(b: Builder) -> None:
    """Keyboard and lid; the lid lies flat when closed."""
    if b.state.openness == 0:
        b.metal((0, -0.45, 0.1), (1, 0.55, 0.88), STEEL)
        b.metal((0, 0.57, 0.1), (1, 0.43, 0.88), shade_of(STEEL, 0.9))
        return
    y = b.thick(0.01, 1)
    b.metal((0, -1 + y, 0.1), (1, y, 0.88), STEEL)
    b.box((0, -1 + 2 * y, 0.1), (0.88, 0.02, 0.5), DARK)
    z = b.thick(0.008, 2)
    b.metal((0, 0, -0.88), (1, 1, z), STEEL)
    b.coin(2, (0, 0.1, -0.88 - z), (0.14, 0.2, z * 0.3), WHITE)
    screen = _SCREEN if b.state.toggled else (0.07, 0.08, 0.1)
    b.box(
        (0, 0.05, -0.88 + z),
        (0.92, 0.86, z * 0.4),
        screen,
        Material.GLASS,
        glow=0.85 if b.state.toggled else 0.0,
    )


@draws
def desk_lamp(b: Builder) -> None:
    """A foot, a stem and a shade that is bright when lit."""
    _lamp(b, foot=0.35, shade_low=0.2)


@draws
def floor_lamp(b: Builder) -> None:
    """The same, tall."""
    _lamp(b, foot=0.6, shade_low=0.62)


def _lamp(b: Builder, foot: float, shade_low: float) -> None:
    lit = b.state.toggled
    y = b.thick(0.015, 1)
    b.tube((0, -1 + y, 0), (foot, y, foot), BRASS, Material.METAL)
    b.rod((0, -0.1, 0), 0.012, float(b.half[1]) * 0.9, 1, BRASS)
    middle = (1 + shade_low) / 2
    half = (1 - shade_low) / 2
    color = _WARM if lit else pick(_SHADES, b.style)
    b.tube((0, middle, 0), (1, half, 1), color, Material.FABRIC, top=0.6, glow=0.95 if lit else 0.0)


@draws
def cell_phone(b: Builder) -> None:
    """A slab of glass in a bright metal edge: a round key, a slit for the ear; icons while on."""
    b.metal((0, -0.15, 0), (1, 0.85, 1), CHROME)
    b.box((0, 0.2, 0), (0.92, 0.68, 0.96), (0.04, 0.04, 0.05))
    lit = b.state.toggled
    b.box((0, 0.86, 0), (0.84, 0.08, 0.74), _SCREEN if lit else (0.1, 0.12, 0.16), Material.GLASS,
          glow=0.8 if lit else 0.0)  # fmt: skip
    b.tube((0, 0.9, 0.85), (0.17, 0.08, 0.085), (0.62, 0.64, 0.68))
    b.box((0, 0.9, -0.86), (0.24, 0.08, 0.018), (0.62, 0.64, 0.68))
    if lit:
        for index, color in enumerate(_ICONS):
            b.box(
                (-0.42 + 0.84 * (index % 2), 0.96, -0.45 + 0.42 * (index // 2)),
                (0.24, 0.04, 0.12),
                color,
                glow=0.7,
            )


@draws
def remote(b: Builder) -> None:
    """A bar with rows of keys."""
    b.box((0, -0.2, 0), (1, 0.8, 1), DARK)
    for row in range(5):
        for side in (-0.45, 0.0, 0.45):
            b.box((side, 0.75, -0.6 + 0.3 * row), (0.15, 0.2, 0.08), (0.7, 0.7, 0.72))
    b.box((-0.45, 0.75, 0.85), (0.18, 0.22, 0.08), (0.85, 0.2, 0.15))


@draws
def vacuum(b: Builder) -> None:
    """A head, a body and a handle."""
    b.box((0, -0.9, 0.4), (1, 0.1, 0.6), (0.6, 0.15, 0.15))
    b.tube((0, -0.2, -0.3), (0.5, 0.6, 0.5), (0.35, 0.36, 0.4), Material.METAL)
    b.rod((0, 0.6, -0.5), 0.015, float(b.half[1]) * 0.4, 1, DARK)


@draws
def alarm_clock(b: Builder) -> None:
    """A round clock on two feet: two bells on top, a face with hands and marks, keys behind."""
    color = pick(((0.75, 0.2, 0.18), (0.2, 0.42, 0.55), (0.3, 0.5, 0.4)), b.style)
    b.coin(2, (0, -0.16, 0), (0.8, 0.8, 0.74), color)
    b.coin(2, (0, -0.16, 0.76), (0.68, 0.68, 0.06), WHITE)
    for x, y in ((0, 0.54), (0.54, 0), (0, -0.54), (-0.54, 0)):
        b.box((x, y - 0.16, 0.82), (0.06, 0.06, 0.05), BLACK)
    b.box((0, 0.04, 0.86), (0.05, 0.24, 0.06), BLACK)
    b.box((0.16, -0.16, 0.86), (0.2, 0.05, 0.06), BLACK)
    for side in (-1, 1):
        b.ball(
            (side * 0.5, 0.68, 0), (0.4, 0.28, 0.6), BRASS, Material.METAL, tilt=(0, 0, side * -35)
        )
        b.box((side * 0.48, -0.88, 0), (0.1, 0.12, 0.4), DARK)
        b.metal((side * 0.3, -0.16, -0.86), (0.16, 0.06, 0.14), BRASS)
    b.box((0, 0.8, 0), (0.06, 0.2, 0.12), DARK)
