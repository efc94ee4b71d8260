"""The register of shapes by object type."""

from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.primitives import Part
from infthor_eval.sim.render.shapes.builder import Builder

__all__ = ["shape"]


def shape(item: SimObject) -> list[Part]:
    """The parts of an object in its own frame, as its type and state make it look."""
    board = Builder(item)
    board.box((0, 0, 0), (1, 1, 1), (0.6, 0.5, 0.4))
    return board.parts
