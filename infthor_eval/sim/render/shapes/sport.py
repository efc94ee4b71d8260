"""Balls, bats, rackets and weights."""

from infthor_eval.sim.render.primitives import Color, Form, Material
from infthor_eval.sim.render.shapes.builder import Builder, shade_of
from infthor_eval.sim.render.shapes.palette import BLACK, CHROME, DARK
from infthor_eval.sim.render.shapes.register import draws


@draws
def ball(b: Builder) -> None:
    """An orange ball with seams."""
    b.ball((0, 0, 0), (0.99, 0.99, 0.99), (0.85, 0.42, 0.12), Material.STONE)
    b.tube((0, 0, 0), (1.005, 0.02, 1.005), BLACK)
    b.add(Form.CYLINDER, (0, 0, 0), (1.005, 0.02, 1.005), BLACK, tilt=(0, 0, 90))


@draws
def bat(b: Builder) -> None:
    """A knob, a wound grip, a slender handle that widens, and a thick barrel with a round end, on its longest side."""
    axis = b.longest
    wood: Color = (0.86, 0.66, 0.4)
    thick = min(float(b.half[i]) for i in range(3) if i != axis)
    b.bar(axis, -1.0, -0.95, (0.5 * thick, 0.5 * thick), wood, Material.WOOD)
    b.bar(axis, -0.95, -0.5, (0.27 * thick, 0.27 * thick), (0.13, 0.13, 0.15), Material.FABRIC)
    b.bar(axis, -0.5, 0.15, (0.27 * thick, 0.8 * thick), wood)
    b.bar(axis, 0.15, 0.9, (0.8 * thick, thick), wood)
    b.bar(axis, 0.32, 0.4, (0.9 * thick, 0.92 * thick), (0.7, 0.15, 0.12))
    half = [thick / float(b.half[i]) for i in range(3)]
    half[axis] = 0.1
    b.ball(b.along(0.9, axis), half, shade_of(wood, 1.05))


@draws
def racket(b: Builder) -> None:
    """A frame of strings on a handle, along its longest side."""
    axis = max(range(3), key=lambda i: float(b.half[i]))
    flat = min(range(3), key=lambda i: float(b.half[i]))
    half, at, grip, low = [1.0] * 3, [0.0] * 3, [0.14] * 3, [0.0] * 3
    half[axis], half[flat], at[axis] = 0.55, 0.5, 0.45
    grip[axis], grip[flat], low[axis] = 0.5, 0.6, -0.5
    b.ball(at, half, (0.85, 0.82, 0.6), Material.FABRIC)
    b.box(low, grip, (0.25, 0.25, 0.5))


@draws
def dumbbell(b: Builder) -> None:
    """Two weights on a bar."""
    b.box((0, 0, 0), (0.25, 0.25, 1), CHROME, Material.METAL)
    for side in (-1, 1):
        b.box((0, 0, side * 0.7), (1, 1, 0.3), DARK)
