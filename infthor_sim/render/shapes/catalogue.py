"""The shape of any object: the drawing that its type names, with dirt and variation of colour."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from infthor_sim.objects import SimObject
from infthor_sim.render.primitives import Color, ShapePart
from infthor_sim.render.shapes.builder import Builder, shade_of

Drawing = Callable[[Builder], None]

_DIRT: Color = (0.36, 0.27, 0.16)
_DIRT_SHARE = 0.45
# objects of one colour differ a little in brightness, by their style
_TINTS = 5
_TINT = 0.045

SHAPES: dict[str, Drawing] = {}
"""The drawings by the names that types give."""


def draws(drawing: Drawing) -> Drawing:
    """Register a drawing under the name of its function."""
    assert drawing.__name__ not in SHAPES, f"two shapes are called {drawing.__name__}"
    SHAPES[drawing.__name__] = drawing
    return drawing


def shape(item: SimObject) -> list[ShapePart]:
    """Return the primitives of an object in its own frame, by its type and state."""
    board = Builder(item)
    SHAPES[item.type.shape](board)
    if item.state.dirty:
        return [replace(part, color=_dirty_color(part.color)) for part in board.parts]
    tint = 1.0 + _TINT * (item.style % _TINTS - _TINTS // 2) / (_TINTS // 2)
    return [replace(part, color=shade_of(part.color, tint)) for part in board.parts]


@draws
def box(b: Builder) -> None:
    """A plain box, for types that name no other shape."""
    b.box((0, 0, 0), (1, 1, 1), (0.6, 0.55, 0.5))


def _dirty_color(color: Color) -> Color:
    red, green, blue = np.array(color) * (1 - _DIRT_SHARE) + np.array(_DIRT) * _DIRT_SHARE
    return float(red), float(green), float(blue)
