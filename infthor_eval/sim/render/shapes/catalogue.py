"""The register of shapes by object type, and what dirt does to any of them."""

from collections.abc import Callable
from dataclasses import replace

from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.primitives import Color, Part
from infthor_eval.sim.render.shapes import appliances, fixtures, food, household, kitchenware, seats, storage, tables
from infthor_eval.sim.render.shapes.builder import Builder

__all__ = ["SHAPES", "shape"]

SHAPES: dict[str, Callable[[Builder], None]] = {
    **appliances.SHAPES,
    **fixtures.SHAPES,
    **food.SHAPES,
    **household.SHAPES,
    **kitchenware.SHAPES,
    **seats.SHAPES,
    **storage.SHAPES,
    **tables.SHAPES,
}
_DIRT: Color = (0.36, 0.27, 0.16)
_DIRT_SHARE = 0.45


def shape(item: SimObject) -> list[Part]:
    """The parts of an object in its own frame, as its type and state make it look; an unknown type is a plain box."""
    board = Builder(item)
    draw = SHAPES.get(item.object_type)
    if draw is None:
        board.box((0, 0, 0), (1, 1, 1), (0.6, 0.55, 0.5))
    else:
        draw(board)
    if item.state.dirty:
        return [replace(part, color=_soiled(part.color)) for part in board.parts]
    return board.parts


def _soiled(color: Color) -> Color:
    r, g, b = (c * (1 - _DIRT_SHARE) + d * _DIRT_SHARE for c, d in zip(color, _DIRT, strict=True))
    return (r, g, b)
