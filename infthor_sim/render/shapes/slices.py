"""Slices of food, each with the rind, flesh and outline of its food."""

from infthor_sim.object_types import OBJECT_TYPES
from infthor_sim.render.primitives import Color, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.food import APPLES, CRUST, LETTUCE, POTATO, TOMATO, loaf

# Number of slices, by the type of slice.
_COUNTS = {whole.slice_type: whole.slices for whole in OBJECT_TYPES.values() if whole.slices}
_RUFFLES = (
    (0.63, 0.12),
    (0.42, 0.52),
    (0.0, 0.66),
    (-0.42, 0.52),
    (-0.63, 0.12),
    (0.46, -0.42),
    (-0.46, -0.42),
)
_FLESH: Color = (0.96, 0.9, 0.6)  # of potatoes
_TOAST: Color = (0.55, 0.33, 0.15)
_CRUMB: Color = (0.95, 0.86, 0.66)


@draws
def bread_slice(b: Builder) -> None:
    """The loaf's outline: crust around crumb, or toast."""
    axis = _thin_axis(b)
    crust, crumb = (
        (shade_of(_TOAST, 0.7), _TOAST) if b.state.cooked else (shade_of(CRUST, 0.8), _CRUMB)
    )
    loaf(b, axis, 1.0, 0.9, crust, Material.PLAIN)
    loaf(b, axis, 0.86, 1.0, crumb, Material.STONE)


@draws
def apple_slice(b: Builder) -> None:
    """The apple's skin around nearly white flesh, with a core and pips."""
    _round(b, APPLES[b.style % 3], (0.97, 0.94, 0.78))
    _spots(b, ((0.0, 0.0),), 0.24, (0.86, 0.82, 0.55))
    _spots(b, ((0.12, 0.06), (-0.12, 0.06), (0.0, -0.14)), 0.07, (0.25, 0.13, 0.07))


@draws
def tomato_slice(b: Builder) -> None:
    """Red around a paler star of walls, with chambers of seeds."""
    _round(b, TOMATO, (0.93, 0.42, 0.3))
    _spots(
        b,
        ((0.45, 0.15), (-0.45, 0.15), (0.0, 0.48), (0.28, -0.4), (-0.28, -0.4)),
        0.2,
        (0.8, 0.2, 0.08),
    )
    _spots(
        b,
        ((0.45, 0.15), (-0.45, 0.15), (0.0, 0.48), (0.28, -0.4), (-0.28, -0.4)),
        0.09,
        (0.96, 0.8, 0.4),
    )


@draws
def potato_slice(b: Builder) -> None:
    """Brown skin around yellow, golden when cooked, and lopsided."""
    skin = shade_of(POTATO, 0.56 if b.state.cooked else 0.8)
    size = _relative_width(b)
    _disc(b, 0.78 * size, 0.55, skin, (0.2 * size, -0.16 * size))
    _round(b, shade_of(POTATO, 0.8), _FLESH)
    _disc(b, 0.72 * size, 1.0, shade_of(_FLESH, 0.78) if b.state.cooked else _FLESH,
          (0.2 * size, -0.16 * size))  # fmt: skip


@draws
def lettuce_slice(b: Builder) -> None:
    """A ruffled leaf, paler within, with a broad white rib from its foot that becomes veins."""
    for index, (aside, up) in enumerate(_RUFFLES):
        off = 0.36 if index % 2 else -0.36
        shade = 1.2 if index % 2 else 0.66
        _disc(b, 0.34, 0.48, shade_of(LETTUCE, shade), (aside, up), off)
    _disc(b, 0.82, 0.85, shade_of(LETTUCE, 1.15), (0.0, 0.0))
    _rib(b, (0.0, -0.2), 0.0, (0.09, 0.72))
    _rib(b, (0.0, -0.62), 0.0, (0.17, 0.36))
    for side in (-1, 1):
        for up in (-0.3, 0.1):
            _rib(b, (side * 0.24, up + 0.22), side * 48.0, (0.045, 0.34))


def _rib(b: Builder, at: tuple[float, float], angle: float, half: tuple[float, float]) -> None:
    """A white rib on both faces, `angle` degrees from upright; half sizes are fractions."""
    thin = _thin_axis(b)
    # A tilted box has half extents along its own axes, hence lengths in metres and not in fractions
    # of the tilted ones.
    wide = half[0] * float(b.half[2 - thin])
    tall = half[1] * float(b.half[1])
    metres = (
        (float(b.half[0]) * 0.95, tall, wide)
        if thin == 0
        else (wide, tall, float(b.half[2]) * 0.95)
    )
    fractions = [m / float(h) for m, h in zip(metres, b.half, strict=True)]
    tilt = (angle, 0.0, 0.0) if thin == 0 else (0.0, 0.0, -angle)
    middle = (0.0, at[1], at[0]) if thin == 0 else (at[0], at[1], 0.0)
    b.box(middle, fractions, (0.95, 0.96, 0.84), tilt=tilt)


def _round(b: Builder, rind: Color, flesh: Color) -> None:
    """A round slice; darker when cooked. Its flesh shows beside the rind from the edge, too."""
    size = _relative_width(b)
    _disc(b, size, 0.6, shade_of(rind, 0.7) if b.state.cooked else rind, (0.0, 0.0))
    _disc(b, 0.93 * size, 1.0, shade_of(flesh, 0.78) if b.state.cooked else flesh, (0.0, 0.0))


def _spots(b: Builder, places: tuple[tuple[float, float], ...], size: float, color: Color) -> None:
    """Round spots on both faces, by their places aside and up."""
    width = _relative_width(b)
    for aside, up in places:
        _disc(b, size * width, 1.04 + 0.2 * (0.3 - size), color, (aside * width, up * width))


def _relative_width(b: Builder) -> float:
    """Return a slice's width as a share of the widest: a round thing's end slices are smaller."""
    # The id ends with the number of the slice.
    number = b.item.object_id.rsplit("_", 1)[-1]
    count = _COUNTS.get(b.item.object_type, 1)
    if not number.isdigit() or not 1 <= int(number) <= count:
        return 1.0
    off = abs((int(number) - 0.5) / count * 2 - 1)
    return float(max(0.55, (1 - off * off) ** 0.5))


def _thin_axis(b: Builder) -> int:
    """Return the level axis across which it was cut."""
    return min((0, 2), key=lambda axis: float(b.half[axis]))


def _disc(
    b: Builder, radius: float, thick: float, color: Color, at: tuple[float, float],
    off: float = 0.0,
) -> None:  # fmt: skip
    """Add a disc across the thin axis, with its middle aside, up, and `off` along that axis."""
    thin = _thin_axis(b)
    half = (thick, radius, radius) if thin == 0 else (radius, radius, thick)
    middle = (off, at[1], at[0]) if thin == 0 else (at[0], at[1], off)
    b.coin(thin, middle, half, color)
