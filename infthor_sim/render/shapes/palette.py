"""Colours that shapes choose from."""

from collections.abc import Sequence

from infthor_sim.render.primitives import Color, Material

WHITE: Color = (0.93, 0.93, 0.91)
PAPER: Color = (0.95, 0.94, 0.88)
BLACK: Color = (0.08, 0.08, 0.09)
DARK: Color = (0.2, 0.2, 0.22)
STEEL: Color = (0.7, 0.71, 0.73)
CHROME: Color = (0.82, 0.84, 0.86)
BRASS: Color = (0.75, 0.6, 0.3)
GLASS: Color = (0.72, 0.84, 0.88)
LEAF: Color = (0.24, 0.5, 0.2)
WOODS: tuple[Color, ...] = (
    (0.55, 0.36, 0.2),
    (0.42, 0.26, 0.15),
    (0.7, 0.52, 0.33),
    (0.62, 0.42, 0.25),
)
CERAMICS: tuple[Color, ...] = (
    (0.92, 0.9, 0.86),
    (0.35, 0.5, 0.65),
    (0.75, 0.35, 0.28),
    (0.4, 0.58, 0.45),
)
CLOTHS: tuple[Color, ...] = (
    (0.3, 0.42, 0.6), (0.65, 0.3, 0.28), (0.45, 0.52, 0.38), (0.7, 0.62, 0.5), (0.42, 0.4, 0.5),
)  # fmt: skip
FLOORS: dict[str, tuple[Color, Material]] = {
    "wood": ((0.62, 0.44, 0.29), Material.PLANKS),
    "tiles": ((0.78, 0.76, 0.72), Material.TILES),
    "carpet": ((0.60, 0.56, 0.52), Material.CARPET),
}


def pick(colors: Sequence[Color], style: int) -> Color:
    """Return the colour of a style number."""
    return colors[style % len(colors)]
