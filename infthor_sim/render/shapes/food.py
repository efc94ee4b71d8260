"""Fruit, vegetables, bread and eggs; slices, each with the rind, flesh and outline of its food."""

from infthor_sim.object_types import OBJECT_TYPES
from infthor_sim.render.primitives import Color, Form, Material
from infthor_sim.render.shapes.builder import Builder, shade_of
from infthor_sim.render.shapes.catalogue import draws
from infthor_sim.render.shapes.palette import pick

APPLES: tuple[Color, ...] = ((0.72, 0.07, 0.09), (0.7, 0.8, 0.24), (0.55, 0.05, 0.12))
CRUST: Color = (0.72, 0.48, 0.24)
LETTUCE: Color = (0.4, 0.66, 0.25)
POTATO: Color = (0.7, 0.55, 0.32)
TOMATO: Color = (0.85, 0.16, 0.1)
_EGGS: tuple[Color, ...] = ((0.93, 0.86, 0.76), (0.97, 0.95, 0.91), (0.9, 0.76, 0.62))
_EGG_TURN = 40.0  # degrees: rooms have their things square to the walls, and seen so an egg is long
# Number of slices, by the type of slice.
_COUNTS = {whole.slice_type: whole.slices for whole in OBJECT_TYPES.values() if whole.slices}
# Of a lettuce leaf's edge, aside and up.
_FRILLS = (
    (0.0, 0.8), (0.36, 0.72), (-0.36, 0.72), (0.6, 0.46), (-0.6, 0.46), (0.62, 0.12),
    (-0.62, 0.12), (0.5, -0.2), (-0.5, -0.2), (0.34, -0.48), (-0.34, -0.48),
)  # fmt: skip
_RIB: Color = (0.95, 0.96, 0.84)  # of lettuce
_FLESH: Color = (0.96, 0.9, 0.6)  # of potatoes
_TOAST: Color = (0.55, 0.33, 0.15)
_CRUMB: Color = (0.95, 0.86, 0.66)


@draws
def apple(b: Builder) -> None:
    """Broad shoulders around a dimple with a stalk and a leaf, narrower below."""
    color = APPLES[b.style % 3]
    b.ball((0, 0.1, 0), (1, 0.7, 1), color)
    b.ball((0, -0.2, 0), (0.92, 0.8, 0.92), color)
    b.tube((0, 0.77, 0), (0.3, 0.04, 0.3), shade_of(color, 0.5))
    b.add(Form.CYLINDER, (0.03, 0.82, 0), (0.08, 0.18, 0.08), (0.3, 0.18, 0.08), tilt=(0, 0, -14))
    b.ball((0.4, 0.88, 0.1), (0.4, 0.08, 0.2), (0.25, 0.55, 0.15))


@draws
def tomato(b: Builder) -> None:
    """A flat red ball with a green star of leaves."""
    b.ball((0, -0.05, 0), (1, 0.95, 1), TOMATO)
    for turn in (0, 60, 120):
        b.box((0, 0.84, 0), (0.62, 0.06, 0.13), (0.16, 0.45, 0.12), tilt=(0, turn, 0))
    b.tube((0, 0.9, 0), (0.09, 0.1, 0.09), (0.25, 0.4, 0.12))


@draws
def potato(b: Builder) -> None:
    """A lopsided tuber with eyes; baked it is darker."""
    color: Color = shade_of(POTATO, 0.62) if b.state.cooked else POTATO
    b.ball((0.06, -0.06, 0.3), (0.9, 0.92, 0.7), color, Material.STONE)
    b.ball((-0.08, 0.0, -0.34), (0.84, 0.96, 0.66), shade_of(color, 0.97), Material.STONE)
    b.ball((-0.3, 0.22, 0.05), (0.66, 0.72, 0.6), shade_of(color, 1.04), Material.STONE)
    eye = shade_of(color, 0.55)
    for x, y, z in (
        (0.3, 0.72, 0.4),
        (-0.4, 0.82, -0.2),
        (0.72, 0.2, 0.2),
        (-0.74, 0.1, -0.5),
        (0.3, 0.72, -0.5),
        (0.25, 0.25, 0.9),
        (-0.1, 0.3, -0.94),
        (-0.55, 0.55, 0.5),
        (0.75, 0.1, -0.4),
    ):
        b.ball((x, y, z), (0.1, 0.1, 0.07), eye)


@draws
def bread(b: Builder) -> None:
    """A tin loaf: a rounded top over a body, with scores across it."""
    axis = 2 if b.half[2] >= b.half[0] else 0
    loaf(b, axis, 1.0, 1.0, CRUST, Material.STONE)
    for at in (-0.6, -0.2, 0.2, 0.6):
        b.box(
            b.lengthwise(at, 0.88, 0),
            b.lengthwise(0.03, 0.13, 0.5),
            (0.9, 0.76, 0.52),
            tilt=(0, 12, 0),
        )


def loaf(
    b: Builder, axis: int, share: float, length: float, color: Color, material: Material
) -> None:
    """Add a tin loaf along `axis`, by shares of its width and height and of its length."""
    at = (0.0, -0.3 * share, 0.0)
    half = [0.86 * share] * 3
    half[1] = 0.7 * share
    half[axis] = length
    b.box(at, half, shade_of(color, 0.92), material)
    metres = [float(v) for v in b.half]
    wide = metres[2 - axis] * share
    high = metres[1] * 0.62 * share
    turned = (wide, high)
    tilt = (90.0, 0.0, 0.0) if axis == 2 else (0.0, 0.0, 90.0)
    radii = [0.0, metres[axis] * length, 0.0]
    radii[0], radii[2] = turned if axis == 2 else (high, wide)
    fractions = [radii[i] / metres[i] for i in range(3)]
    b.add(Form.CYLINDER, (0, 0.38 * share, 0), fractions, color, material, tilt=tilt)


@draws
def lettuce(b: Builder) -> None:
    """A head of dark leaves with pale ones around it, a yellow heart, frills, a white stalk."""
    b.ball((0, -0.3, 0), (1, 0.68, 1), shade_of(LETTUCE, 0.72), Material.STONE)
    pale: Color = (0.55, 0.78, 0.32)
    for x, z in ((-0.4, 0.3), (0.4, 0.2), (0.0, -0.45)):
        b.ball((x, 0.25, z), (0.6, 0.7, 0.55), pale)
    for x, z in ((0.05, 0.62), (-0.5, -0.33), (0.52, -0.33)):
        b.ball((x, 0.1, z), (0.42, 0.72, 0.36), shade_of(LETTUCE, 0.9), Material.STONE)
    for x, z in ((-0.5, 0.42), (0.5, 0.34), (0.0, -0.6)):
        b.ball((x, 0.72, z), (0.4, 0.22, 0.34), (0.74, 0.9, 0.46))
    b.ball((0, 0.6, 0), (0.46, 0.36, 0.46), (0.88, 0.9, 0.5))
    b.tube((0, -0.9, 0), (0.42, 0.1, 0.42), (0.93, 0.94, 0.82))


@draws
def egg(b: Builder) -> None:
    """A white, cream or tan egg on its side."""
    b.ball((0, -0.26, 0), (0.74, 0.74, 1.06), pick(_EGGS, b.style), tilt=(0, _EGG_TURN, 0))


@draws
def egg_cracked(b: Builder) -> None:
    """White and yolk, or fried."""
    white: Color = (0.98, 0.95, 0.88) if b.state.cooked else (0.95, 0.95, 0.92)
    b.tube((0, -0.5, 0), (1, 0.5, 1), white)
    b.ball((0, 0.1, 0), (0.4, 0.9, 0.4), (0.96, 0.72, 0.15))


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
    """A single leaf, narrow at its white foot and frilled above, with a rib that becomes veins."""
    for index, (aside, up) in enumerate(_FRILLS):
        off = 0.36 if index % 2 else -0.36
        shade = 1.2 if index % 2 else 0.66
        _disc(b, 0.2, 0.48, shade_of(LETTUCE, shade), (aside, up), off)
    for up, radius in ((0.28, 0.6), (-0.05, 0.5), (-0.38, 0.38), (-0.66, 0.3)):
        _disc(b, radius, 0.85, shade_of(LETTUCE, 1.3), (0.0, up))
    _disc(b, 0.17, 0.95, _RIB, (0.0, -0.8))
    for up, width in ((-0.6, 0.12), (-0.2, 0.085), (0.2, 0.055)):
        _rib(b, (0.0, up), 0.0, (width, 0.24))
    for side in (-1, 1):
        for up in (-0.3, 0.0, 0.3):
            _rib(b, (side * 0.2, up + 0.12), side * 60.0, (0.022, 0.22))


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
    b.box(middle, fractions, _RIB, tilt=tilt)


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
