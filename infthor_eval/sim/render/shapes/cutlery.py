"""Knives, forks, spoons, spatulas and ladles; their handles point towards +z."""

from infthor_eval.sim.render.primitives import Color, Form, Material
from infthor_eval.sim.render.shapes.builder import Builder, shade_of
from infthor_eval.sim.render.shapes.palette import CHROME, DARK, STEEL
from infthor_eval.sim.render.shapes.register import draws

_BRIGHT: Color = (0.9, 0.92, 0.95)
_GRIP: Color = (0.15, 0.13, 0.12)


@draws
def knife(b: Builder) -> None:
    """A broad blade that runs to a point, and a dark handle with rivets."""
    b.box((0, 0, 0.66), (0.5, 1, 0.34), _GRIP)
    for at in (0.5, 0.66, 0.82):
        b.box((0, 0.8, at), (0.14, 0.3, 0.02), STEEL)
    b.box((0.15, 0, -0.12), (0.85, 0.4, 0.44), _BRIGHT, Material.METAL)
    b.add(Form.CYLINDER, (0.15, 0, -0.56), (0.85, 0.22, 0.4), _BRIGHT, Material.METAL, tilt=(0, 0, 0))


@draws
def butter_knife(b: Builder) -> None:
    """All of bright steel: a stout round handle, a neck, and a blade with a round end and a notch."""
    b.ball((0, 0, 0.58), (0.75, 1, 0.42), shade_of(STEEL, 0.85), Material.METAL)
    b.box((0, 0, 0.12), (0.35, 0.7, 0.1), CHROME, Material.METAL)
    b.box((0.1, 0, -0.36), (0.9, 0.5, 0.4), _BRIGHT, Material.METAL)
    b.ball((0.1, 0, -0.76), (0.9, 0.5, 0.22), _BRIGHT, Material.METAL)
    b.box((-0.75, 0.1, -0.05), (0.25, 0.6, 0.04), DARK)


@draws
def fork(b: Builder) -> None:
    """A handle and tines."""
    b.box((0, 0, 0.35), (0.3, 0.6, 0.65), STEEL, Material.METAL)
    b.box((0, 0, -0.4), (1, 0.6, 0.14), STEEL, Material.METAL)
    for at in (-0.8, -0.27, 0.27, 0.8):
        b.box((at, 0.2, -0.75), (0.16, 0.5, 0.25), STEEL, Material.METAL)


@draws
def spoon(b: Builder) -> None:
    """A handle and a bowl."""
    b.box((0, 0.1, 0.35), (0.3, 0.5, 0.65), STEEL, Material.METAL)
    b.ball((0, 0, -0.65), (1, 1, 0.35), CHROME, Material.METAL)


@draws
def spatula(b: Builder) -> None:
    """A slotted blade on a long handle."""
    b.box((0, 0.2, 0.35), (0.22, 0.6, 0.65), DARK)
    b.box((0, -0.3, -0.65), (1, 0.5, 0.35), (0.3, 0.3, 0.32))
    for at in (-0.4, 0.0, 0.4):
        b.box((at, 0.25, -0.65), (0.1, 0.1, 0.22), (0.6, 0.6, 0.62))


@draws
def ladle(b: Builder) -> None:
    """A cup at the end of a long handle."""
    b.cup((0, -0.3, -0.68), (0.95, 0.7, 0.32), STEEL, Material.METAL, bottom=0.6)
    b.box((0, 0.5, 0.3), (0.15, 0.2, 0.7), CHROME, Material.METAL)
