"""Dishes, pots, cutlery, bottles."""

from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, Vector, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import (
    BLACK,
    CERAMICS,
    CHROME,
    DARK,
    GLASS,
    STEEL,
    WHITE,
    WOODS,
    pick,
)

_LIQUIDS: dict[str, Color] = {
    "water": (0.5, 0.72, 0.88),
    "coffee": (0.25, 0.14, 0.07),
    "wine": (0.45, 0.05, 0.12),
}


def _liquid(b: Builder, level: float, radius: float, at: tuple[float, float] = (0.0, 0.0)) -> None:
    if b.state.fill_liquid is not None:
        color = _LIQUIDS.get(b.state.fill_liquid, _LIQUIDS["water"])
        b.tube((at[0], level, at[1]), (radius, 0.02, radius), color)


def _inner_floor(
    b: Builder,
    radius: float,
    color: Color,
    at: Vector = (0.0, 0.0, 0.0),
    half: Vector = (1.0, 1.0, 1.0),
) -> None:
    """A disc in a vessel up to where its contents stand, with a share of its radius."""
    b.tube(
        (at[0], (b.floor - 1) / 2, at[2]),
        (half[0] * radius, (b.floor + 1) / 2, half[2] * radius),
        color,
    )


@draws
def mug(b: Builder) -> None:
    """A cup with a handle on the longer side."""
    color = pick(CERAMICS, b.style)
    ratio = b.slenderness
    at = b.lengthwise(ratio - 1, 0, 0)
    half = b.lengthwise(ratio, 1, 1)
    b.cup(at, half, color, bottom=0.85)
    _inner_floor(b, 0.85, shade_of(color, 0.8), at, half)
    _liquid(b, 0.6, min(half[0], half[2]) * 0.9, (at[0], at[2]))
    reach = max(1 - (2 * ratio - 1), 0.25)
    for level in (-0.45, 0.45):
        b.box(b.lengthwise(1 - reach / 2, level, 0), b.lengthwise(reach / 2, 0.1, 0.12), color)
    b.box(b.lengthwise(0.93, 0, 0), b.lengthwise(0.07, 0.55, 0.12), color)


@draws
def cup(b: Builder) -> None:
    """A tumbler."""
    color = pick((GLASS, (0.4, 0.6, 0.75), (0.8, 0.5, 0.3)), b.style)
    b.cup((0, 0, 0), (1, 1, 1), color, Material.GLASS, bottom=0.75)
    _inner_floor(b, 0.75, shade_of(color, 0.8))
    _liquid(b, 0.4, 0.85)


@draws
def bowl(b: Builder) -> None:
    """A round bowl on a foot, its inside lighter and its rim of another shade."""
    color = pick(CERAMICS, b.style)
    inside = shade_of(color, 1.25) if max(color) < 0.8 else (0.8, 0.86, 0.92)
    b.tube((0, -0.86, 0), (0.46, 0.14, 0.46), shade_of(color, 0.8))
    b.bowl((0, 0.06, 0), (1, 0.94, 1), color)
    b.bowl((0, 0.1, 0), (0.92, 0.9, 0.92), inside)
    _liquid(b, 0.45, 0.82)


@draws
def plate(b: Builder) -> None:
    """A flat plate with a rim."""
    color = pick(CERAMICS, b.style)
    b.cup((0, 0, 0), (1, 1, 1), color, bottom=0.65)
    _inner_floor(b, 0.66, shade_of(color, 0.92))


@draws
def pot(b: Builder) -> None:
    """A pot with two ears."""
    color = pick((STEEL, (0.35, 0.36, 0.38), (0.6, 0.25, 0.2)), b.style)
    half = b.lengthwise(max(0.6, b.slenderness * 0.98), 1, 1)
    if abs(b.half[0] - b.half[2]) < 0.05 * b.half[0]:
        half = (0.85, 1, 0.85)
    b.cup((0, 0, 0), half, color, Material.METAL, bottom=0.92)
    _inner_floor(b, 0.92, shade_of(color, 0.7), half=half)
    _liquid(b, 0.3, min(half[0], half[2]) * 0.94)
    for side in (-1, 1):
        b.box(b.lengthwise(side * 0.92, 0.65, 0), b.lengthwise(0.08, 0.08, 0.3), BLACK)


@draws
def pan(b: Builder) -> None:
    """A shallow pan: a long round handle, thicker at its end, on a steel mount at the rim."""
    ratio = min(0.95, b.slenderness)
    at = b.lengthwise(ratio - 1, 0, 0)
    half = b.lengthwise(ratio, 0.95, 1)
    b.cup(at, half, DARK, Material.METAL, bottom=0.88)
    _inner_floor(b, 0.88, (0.14, 0.14, 0.15), at, half)
    length = max(1 - ratio, 0.05)
    axis = 0 if b.half[0] >= b.half[2] else 2
    rim = 1 - 2 * length
    b.bar(axis, rim - 0.03, rim + 0.4 * length, (0.008, 0.008), STEEL, Material.METAL)
    b.bar(axis, rim + 0.4 * length, 0.97, (0.01, 0.014), BLACK)
    b.bar(axis, 0.97, 1.0, (0.014, 0.009), BLACK)


@draws
def kettle(b: Builder) -> None:
    """A round kettle with a spout and a handle over its lid."""
    color = pick((STEEL, (0.65, 0.2, 0.16), (0.3, 0.45, 0.55)), b.style)
    b.tube((0, -0.4, 0), (0.85, 0.6, 0.85), color, Material.METAL, top=0.7)
    b.ball((0, 0.2, 0), (0.6, 0.2, 0.6), shade_of(color, 0.9), Material.METAL)
    b.add(Form.CYLINDER, (0, -0.05, 0.78), (0.12, 0.4, 0.12), color, tilt=(50, 0, 0))
    for side in (-1, 1):
        b.box((0, 0.45, side * 0.5), (0.08, 0.5, 0.06), BLACK)
    b.box((0, 0.92, 0), (0.1, 0.08, 0.55), BLACK)


def _bottle(b: Builder, color: Color, label: Color, neck: float) -> None:
    b.tube((0, -0.35, 0), (1, 0.65, 1), color, Material.GLASS)
    b.tube((0, 0.42, 0), (1, 0.14, 1), color, Material.GLASS, top=neck)
    b.tube((0, 0.75, 0), (neck, 0.25, neck), color, Material.GLASS)
    b.tube((0, -0.35, 0), (1.02, 0.3, 1.02), label, Material.PAPER)
    if b.state.broken:
        b.box((0, 0.1, 0.9), (0.05, 0.5, 0.2), BLACK)


@draws
def wine_bottle(b: Builder) -> None:
    """A dark bottle with a label."""
    _bottle(b, (0.12, 0.25, 0.14), (0.9, 0.87, 0.75), 0.35)


@draws
def bottle(b: Builder) -> None:
    """A clear bottle with a coloured label."""
    _bottle(b, GLASS, pick(((0.3, 0.5, 0.7), (0.75, 0.4, 0.25)), b.style), 0.4)


@draws
def salt_shaker(b: Builder) -> None:
    """A white shaker with an S on its front and back."""
    _shaker(b, WHITE, (0.1, 0.2, 0.5), CHROME)
    for face in (-1, 1):
        for level in (-0.9, 0.0, 0.9):
            _stroke(b, face, (0.0, level), (0.9, 0.2), (0.1, 0.2, 0.5))
        _stroke(b, face, (-0.7, 0.45), (0.24, 0.45), (0.1, 0.2, 0.5))
        _stroke(b, face, (0.7, -0.45), (0.24, 0.45), (0.1, 0.2, 0.5))


@draws
def pepper_shaker(b: Builder) -> None:
    """A nearly black shaker with a dark cap and a P on its front and back."""
    _shaker(b, (0.14, 0.11, 0.1), BLACK, (0.5, 0.32, 0.18))
    for face in (-1, 1):
        for level in (0.0, 0.9):
            _stroke(b, face, (0.0, level), (0.9, 0.2), WHITE)
        _stroke(b, face, (-0.7, 0.0), (0.24, 1.1), WHITE)
        _stroke(b, face, (0.7, 0.45), (0.24, 0.45), WHITE)


def _stroke(
    b: Builder, face: int, at: tuple[float, float], half: tuple[float, float], color: Color
) -> None:
    """A stroke of a letter on a shaker's front (1) or back (-1), in shares of the letter."""
    b.box(
        (-face * at[0] * 0.36, -0.3 + 0.4 * at[1], face * 0.9),
        (half[0] * 0.36, 0.4 * half[1], 0.08),
        color,
    )


def _shaker(b: Builder, body: Color, holes: Color, cap: Color) -> None:
    """A round body with a cap that has holes."""
    b.tube((0, -0.2, 0), (1, 0.8, 1), body, top=0.92)
    b.tube((0, 0.78, 0), (0.84, 0.2, 0.84), cap, Material.METAL, top=0.75)
    b.box((0, 0.98, 0), (0.4, 0.02, 0.1), holes)
    b.box((0, 0.98, 0), (0.1, 0.02, 0.4), holes)


@draws
def paper_roll(b: Builder) -> None:
    """A roll of kitchen paper on a post."""
    color: Color = (0.75, 0.7, 0.6) if b.state.used_up else (0.96, 0.96, 0.94)
    width = 0.35 if b.state.used_up else 1.0
    b.tube((0, 0, 0), (width, 0.95, width), color, Material.FABRIC)
    b.tube((0, 0, 0), (0.2, 1, 0.2), pick(WOODS, b.style))
