"""Slices of food, each with the rind, flesh and outline of its food."""

from infthor_eval.sim.object_types import OBJECT_TYPES
from infthor_eval.sim.render.primitives import Color, Form, Material
from infthor_eval.sim.render.shapes.builder import Builder, shade_of
from infthor_eval.sim.render.shapes.food import APPLES, CRUST, LETTUCE, POTATO, TOMATO, loaf
from infthor_eval.sim.render.shapes.register import draws

# Number of slices, by the type of slice.
_COUNTS = {whole.slice_type: whole.slices for whole in OBJECT_TYPES.values() if whole.slices}
_RUFFLES = ((0.42, 0.42), (0.42, -0.42), (-0.42, 0.42), (-0.42, -0.42))
_TOAST: Color = (0.55, 0.33, 0.15)
_CRUMB: Color = (0.95, 0.86, 0.66)


@draws
def bread_slice(b: Builder) -> None:
    """The loaf's outline: crust around crumb, or toast."""
    axis = _thin_axis(b)
    crust, crumb = (shade_of(_TOAST, 0.7), _TOAST) if b.state.cooked else (shade_of(CRUST, 0.8), _CRUMB)
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
    _spots(b, ((0.45, 0.15), (-0.45, 0.15), (0.0, 0.48), (0.28, -0.4), (-0.28, -0.4)), 0.2, (0.8, 0.2, 0.08))
    _spots(b, ((0.45, 0.15), (-0.45, 0.15), (0.0, 0.48), (0.28, -0.4), (-0.28, -0.4)), 0.09, (0.96, 0.8, 0.4))


@draws
def potato_slice(b: Builder) -> None:
    """Brown skin around yellow, golden when cooked."""
    _round(b, shade_of(POTATO, 0.8), (0.96, 0.9, 0.6))


@draws
def lettuce_slice(b: Builder) -> None:
    """Ruffled leaves, dark at the edge and nearly white at the heart."""
    for aside, up in _RUFFLES:
        _disc(b, 0.5, 0.7, shade_of(LETTUCE, 0.8), (aside, up))
        _disc(b, 0.38, 0.86, (0.62, 0.82, 0.4), (aside, up))
    _disc(b, 0.86, 0.68, LETTUCE, (0.0, 0.0))
    _disc(b, 0.7, 0.84, (0.62, 0.82, 0.4), (0.0, 0.0))
    _disc(b, 0.34, 1.0, (0.88, 0.93, 0.72), (0.0, 0.0))


def _round(b: Builder, rind: Color, flesh: Color) -> None:
    """A round slice; darker when cooked."""
    size = _relative_width(b)
    _disc(b, size, 0.92, shade_of(rind, 0.7) if b.state.cooked else rind, (0.0, 0.0))
    _disc(b, 0.86 * size, 1.0, shade_of(flesh, 0.78) if b.state.cooked else flesh, (0.0, 0.0))


def _spots(b: Builder, places: tuple[tuple[float, float], ...], size: float, color: Color) -> None:
    """Round spots on both faces, by their places aside and up."""
    width = _relative_width(b)
    for aside, up in places:
        _disc(b, size * width, 1.04 + 0.2 * (0.3 - size), color, (aside * width, up * width))


def _relative_width(b: Builder) -> float:
    """Return the width of a slice as a share of the widest: the first and last slices of a round thing are smaller."""
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


def _disc(b: Builder, radius: float, thick: float, color: Color, at: tuple[float, float]) -> None:
    """Add a disc across the thin axis, with its middle aside and up."""
    thin = _thin_axis(b)
    tilt = (0.0, 0.0, 90.0) if thin == 0 else (90.0, 0.0, 0.0)
    x, y, z = (float(v) for v in b.half)
    # Half extents are fractions of the object's axes, but the tilted cylinder's axes lie along others: hence ratios.
    half = (radius * y / x, thick * x / y, radius) if thin == 0 else (radius, thick * z / y, radius * y / z)
    middle = (0.0, at[1], at[0]) if thin == 0 else (at[0], at[1], 0.0)
    b.add(Form.CYLINDER, middle, half, color, tilt=tilt)
