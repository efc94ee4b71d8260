"""Fruit, vegetables, bread, eggs, and their slices."""

from infthor_eval.sim.render.primitives import Color, Form, Material
from infthor_eval.sim.render.shapes.builder import Builder, shade_of
from infthor_eval.sim.render.shapes.register import draws

__all__: list[str] = []

_APPLE: tuple[Color, ...] = ((0.78, 0.12, 0.1), (0.55, 0.7, 0.2), (0.8, 0.3, 0.15))
_TOAST: Color = (0.55, 0.33, 0.15)


@draws
def apple(b: Builder) -> None:
    """A round fruit with a stalk."""
    b.ball((0, -0.05, 0), (1, 0.95, 1), _APPLE[b.style % 3])
    b.tube((0, 0.92, 0), (0.06, 0.14, 0.06), (0.35, 0.22, 0.1))


@draws
def tomato(b: Builder) -> None:
    """A red ball with a green star."""
    b.ball((0, -0.05, 0), (1, 0.95, 1), (0.85, 0.16, 0.1))
    b.tube((0, 0.88, 0), (0.3, 0.05, 0.3), (0.2, 0.5, 0.15), bottom=0.2)


@draws
def potato(b: Builder) -> None:
    """A knobbly brown ball; baked it is darker."""
    color: Color = (0.45, 0.28, 0.14) if b.state.cooked else (0.66, 0.5, 0.3)
    b.ball((0, 0, 0), (1, 1, 1), color, Material.STONE)
    b.ball((0.3, 0.2, 0.4), (0.6, 0.75, 0.5), shade_of(color, 1.06), Material.STONE)


@draws
def lettuce(b: Builder) -> None:
    """A head of leaves."""
    b.ball((0, 0, 0), (1, 1, 1), (0.4, 0.66, 0.25), Material.STONE)
    for x, z in ((-0.4, 0.3), (0.4, 0.2), (0.0, -0.45)):
        b.ball((x, 0.25, z), (0.6, 0.7, 0.55), (0.52, 0.76, 0.34))


@draws
def bread(b: Builder) -> None:
    """A loaf with scores across it."""
    color: Color = (0.72, 0.48, 0.24)
    b.box((0, -0.3, 0), (0.95, 0.7, 0.98), color, Material.STONE)
    b.ball((0, 0.1, 0), (1, 0.9, 1), shade_of(color, 1.05), Material.STONE)
    for at in (-0.5, 0.0, 0.5):
        b.box((0, 0.82, at), (0.6, 0.12, 0.04), (0.9, 0.75, 0.5))


@draws
def egg(b: Builder) -> None:
    """An egg."""
    b.ball((0, 0, 0), (1, 1, 1), (0.93, 0.86, 0.76))


@draws
def egg_cracked(b: Builder) -> None:
    """White and yolk, or fried."""
    white: Color = (0.98, 0.95, 0.88) if b.state.cooked else (0.95, 0.95, 0.92)
    b.tube((0, -0.5, 0), (1, 0.5, 1), white)
    b.ball((0, 0.1, 0), (0.4, 0.9, 0.4), (0.96, 0.72, 0.15))


@draws
def bread_slice(b: Builder) -> None:
    """A square slice: crust around crumb, or toast."""
    crust: Color = (0.6, 0.38, 0.18)
    inner = (1, 0.85, 0.85) if _thin(b) == 0 else (0.85, 0.85, 1)
    b.box((0, 0, 0), (0.96, 1, 0.96), shade_of(crust, 0.7) if b.state.cooked else crust)
    b.box((0, 0, 0), inner, _TOAST if b.state.cooked else (0.9, 0.78, 0.55), Material.STONE)


@draws
def apple_slice(b: Builder) -> None:
    """Red around nearly white."""
    _slice(b, (0.78, 0.15, 0.12), (0.95, 0.92, 0.75))


@draws
def lettuce_slice(b: Builder) -> None:
    """Dark green around light green."""
    _slice(b, (0.3, 0.6, 0.22), (0.7, 0.85, 0.5))


@draws
def potato_slice(b: Builder) -> None:
    """Brown around yellow."""
    _slice(b, (0.6, 0.45, 0.25), (0.92, 0.85, 0.55))


@draws
def tomato_slice(b: Builder) -> None:
    """Red around pale red."""
    _slice(b, (0.8, 0.15, 0.1), (0.9, 0.4, 0.3))


def _slice(b: Builder, rind: Color, flesh: Color) -> None:
    """A round slice, thin along its shortest side; darker when cooked."""
    cooked = b.state.cooked
    _disc(b, 1.0, 0.9, shade_of(rind, 0.7) if cooked else rind)
    _disc(b, 0.85, 1.0, shade_of(flesh, 0.75) if cooked else flesh)


def _thin(b: Builder) -> int:
    return min((0, 2), key=lambda axis: float(b.half[axis]))


def _disc(b: Builder, radius: float, thick: float, color: Color) -> None:
    """A disc across the thin axis; the builder's halves are those of the turned cylinder."""
    thin = _thin(b)
    tilt = (0.0, 0.0, 90.0) if thin == 0 else (90.0, 0.0, 0.0)
    x, y, z = (float(v) for v in b.half)
    half = (radius * y / x, thick * x / y, radius) if thin == 0 else (radius, thick * z / y, radius * y / z)
    b.add(Form.CYLINDER, (0, 0, 0), half, color, tilt=tilt)
