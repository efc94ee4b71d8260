"""Building an object's shape: coordinates from -1 to 1 across its box, front towards +z."""

import zlib
from collections.abc import Sequence
from functools import partialmethod

import numpy as np

from infthor_sim.geometry import Array, euler_matrix, yaw_matrix
from infthor_sim.objects import WALL, SimObject, SimObjectState
from infthor_sim.render.primitives import Color, Form, Material, ShapePart

Vector = Sequence[float] | Array
CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))  # across and along
_LINING = 0.003  # metres of the walls of open things that have the colour of their inside


def shade_of(color: Color, factor: float) -> Color:
    """Return a colour made darker (factor below 1) or lighter."""
    return (min(color[0] * factor, 1.0), min(color[1] * factor, 1.0), min(color[2] * factor, 1.0))


class Builder:
    """Collects the parts of one object.

    Positions are fractions of the half box from its centre: (0, -1, 0) is the middle of the
    underside, (0, 0, 1) the middle of the front. Half extents are fractions too, so (1, 1, 1) fills
    the box. Shapes so fit objects of any size.

    Attributes:
        parts: primitives so far.
        half: half extents of the object's box seen from its front, metres (3,).
        style: index that varies colours; recorded objects of one model share it.
        mark: number of this one object, by which things that are otherwise alike differ.
    """

    def __init__(self, item: SimObject) -> None:
        self.item = item
        self.state: SimObjectState = item.state
        self.parts: list[ShapePart] = []
        self.style = item.style
        self.mark = zlib.crc32(item.object_id.encode())
        self._turn = yaw_matrix(item.front)
        self.half: Array = item.front_size / 2

    def thick(self, metres: float, axis: int) -> float:
        """Return a length in metres as a fraction of the half box along `axis`, at most 1."""
        return min(1.0, metres / max(float(self.half[axis]), 1e-6))

    def extent(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return lengths in metres along the three axes as `thick` does."""
        return self.thick(x, 0), self.thick(y, 1), self.thick(z, 2)

    def sides(self, x: float, z: float) -> tuple[float, float]:
        """Return lengths in metres along both horizontal axes as `thick` does."""
        return self.thick(x, 0), self.thick(z, 2)

    @property
    def slenderness(self) -> float:
        """The shorter horizontal side as a share of the longer one."""
        sides = float(self.half[0]), float(self.half[2])
        return min(sides) / max(sides)

    def lengthwise(self, along: float, y: float, across: float) -> tuple[float, float, float]:
        """Return a position or half extents given along and across the longer horizontal side."""
        return (along, y, across) if self.half[0] >= self.half[2] else (across, y, along)

    def metric(self, at: Vector) -> Array:
        """Return a position given in fractions as metres in the object's frame (3,)."""
        return self.item.box_center + self._turn @ (np.asarray(at, dtype=float) * self.half)

    def add(
        self,
        form: Form,
        at: Vector,
        half: Vector,
        color: Color,
        material: Material = Material.PLAIN,
        *,
        tilt: Vector = (0.0, 0.0, 0.0),
        bottom: float = 1.0,
        top: float = 1.0,
        glow: float = 0.0,
    ) -> None:
        """Add a primitive; `tilt` are Euler angles in degrees about its own middle."""
        matrix = self._turn @ euler_matrix(tilt) if any(tilt) else self._turn
        metres = np.asarray(half, dtype=float) * self.half
        self.parts.append(
            ShapePart(form, self.metric(at), metres, color, material, matrix, bottom, top, glow)
        )

    box = partialmethod(add, Form.BOX)
    wood = partialmethod(add, Form.BOX, material=Material.WOOD)
    metal = partialmethod(add, Form.BOX, material=Material.METAL)
    cloth = partialmethod(add, Form.BOX, material=Material.FABRIC)
    ball = partialmethod(add, Form.ELLIPSOID)
    tube = partialmethod(add, Form.CYLINDER)  # upright; `bottom` and `top` are its relative radii
    cup = partialmethod(add, Form.CUP)
    bowl = partialmethod(add, Form.BOWL)

    def level(self, metres: float) -> float:
        """Return a height above the underside of the box, metres, as a position in fractions."""
        return min(1.0, metres / max(float(self.half[1]), 1e-6) - 1)

    @property
    def support(self) -> float:
        """The height in fractions at which things stand on it."""
        return 1.0 if self.item.support is None else self.level(self.item.support)

    @property
    def floor(self) -> float:
        """The height in fractions at which contents stand on the lowest floor inside it."""
        return self.level(self.item.floors[0])

    def span(
        self,
        low: Vector,
        high: Vector,
        color: Color,
        material: Material = Material.PLAIN,
        *,
        glow: float = 0.0,
    ) -> None:
        """Add a box between two corners in fractions."""
        start, end = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        self.box((start + end) / 2, (end - start) / 2, color, material, glow=glow)

    def open_front(
        self,
        outside: Color,
        inside: Color,
        material: Material,
        floor: float,
        *,
        glow: float = 0.0,
        top: bool = True,
    ) -> None:
        """Add a box without its front: five boards, `WALL` thick, with a lining of its own colour.

        Args:
            outside, inside: colours of the boards and of their lining.
            material: surface pattern of both.
            floor: thickness of the lower board, metres.
            glow: share of light of its own of the lining.
            top: whether it has an upper board: sinks hang in cabinets without.
        """
        board = WALL - _LINING
        below = floor - _LINING
        self._boards((0.0, 0.0), (board, below), outside, material, 0.0, top)
        self._boards((board, below), (_LINING, _LINING), inside, material, glow, top)

    def _boards(
        self,
        inset: tuple[float, float],
        thick: tuple[float, float],
        color: Color,
        material: Material,
        glow: float,
        top: bool,
    ) -> None:
        """Add back, sides, bottom and, with `top`, the upper board.

        Args:
            inset: metres from the box's sides, and from its underside.
            thick: thickness in metres of all but the bottom, and of the bottom.
            color, material, glow: of all boards.
            top: whether there is an upper board.
        """
        size = 2 * self.half
        (x, y, z) = inset[0] / size * 2
        (dx, dy, dz) = thick[0] / size * 2
        low = self.level(inset[1])
        floor = self.level(inset[1] + thick[1])
        back = -1 + z + dz
        self.span((x - 1, low, z - 1), (1 - x, 1 - y, back), color, material, glow=glow)
        self.span((x - 1, low, back), (x - 1 + dx, 1 - y, 1), color, material, glow=glow)
        self.span((1 - x - dx, low, back), (1 - x, 1 - y, 1), color, material, glow=glow)
        if top:
            self.span(
                (x - 1 + dx, 1 - y - dy, back), (1 - x - dx, 1 - y, 1), color, material, glow=glow
            )
        self.span((x - 1 + dx, low, back), (1 - x - dx, floor, 1), color, material, glow=glow)

    def open_top(
        self, color: Color, material: Material, wall: float, floor: float, glow: float = 0.0
    ) -> None:
        """Add a box without lid: four sides `wall` metres thick, a bottom; `glow`: inside light.

        Args:
            floor: height of the bottom's upper side in fractions.
        """
        x, z = self.sides(wall / 2, wall / 2)
        self.span((-1, -1, -1), (1, floor, 1), shade_of(color, 0.88), material, glow=glow)
        for side in (-1, 1):
            self.box(
                (side * (1 - x), (1 + floor) / 2, 0),
                (x, (1 - floor) / 2, 1),
                color,
                material,
                glow=glow,
            )
            self.box(
                (0, (1 + floor) / 2, side * (1 - z)),
                (1 - 2 * x, (1 - floor) / 2, z),
                color,
                material,
                glow=glow,
            )

    def coin(
        self, axis: int, at: Vector, half: Vector, color: Color,
        material: Material = Material.PLAIN, *,
        glow: float = 0.0,
    ) -> None:  # fmt: skip
        """Add a round or oval disc with flat sides along `axis`; `half` in fractions of x, y, z."""
        metres = np.asarray(half, dtype=float) * self.half
        tilt, order = {0: ((0.0, 0.0, 90.0), [1, 0, 2]), 1: ((0.0, 0.0, 0.0), [0, 1, 2]),
                       2: ((90.0, 0.0, 0.0), [0, 2, 1])}[axis]  # fmt: skip
        matrix = self._turn @ euler_matrix(tilt)
        self.parts.append(
            ShapePart(
                Form.CYLINDER,
                self.metric(at),
                metres[order],
                color,
                material,
                matrix,
                emission=glow,
            )
        )

    @property
    def longest(self) -> int:
        """The axis of its longest side."""
        return max(range(3), key=lambda i: float(self.half[i]))

    def along(self, at: float, axis: int) -> tuple[float, float, float]:
        """Return a position on one of the box's middle lines."""
        return (at if axis == 0 else 0.0, at if axis == 1 else 0.0, at if axis == 2 else 0.0)

    def bar(
        self,
        axis: int,
        start: float,
        end: float,
        radii: tuple[float, float],
        color: Color,
        material: Material = Material.PLAIN,
        *,
        glow: float = 0.0,
    ) -> None:
        """Add a round bar on the middle line of `axis` from `start` to `end`, radii in metres."""
        tilt = {0: (0.0, 0.0, -90.0), 1: (0.0, 0.0, 0.0), 2: (90.0, 0.0, 0.0)}[axis]
        matrix = self._turn @ euler_matrix(tilt)
        widest = max(radii)
        half = (widest, (end - start) / 2 * float(self.half[axis]), widest)
        bottom, top = radii[0] / widest, radii[1] / widest
        at = self.metric(self.along((start + end) / 2, axis))
        self.parts.append(
            ShapePart(Form.CYLINDER, at, half, color, material, matrix, bottom, top, glow)
        )

    def rod(self, at: Vector, radius: float, length: float, axis: int, color: Color) -> None:
        """Add a round bar, `radius` and half `length` in metres, along axis 0, 1 or 2."""
        tilt = {0: (0.0, 0.0, 90.0), 1: (0.0, 0.0, 0.0), 2: (90.0, 0.0, 0.0)}[axis]
        matrix = self._turn @ euler_matrix(tilt)
        self.parts.append(
            ShapePart(
                Form.CYLINDER,
                self.metric(at),
                (radius, length, radius),
                color,
                Material.METAL,
                matrix,
            )
        )

    def slab(
        self, at: Vector, metres: Vector, color: Color, material: Material = Material.PLAIN
    ) -> None:
        """Add a box whose half extents are given in metres."""
        self.parts.append(
            ShapePart(Form.BOX, self.metric(at), tuple(metres), color, material, self._turn)
        )

    def hinged_box(
        self,
        hinge: Vector,
        offset: Vector,
        metres: Vector,
        angle: float,
        color: Color,
        material: Material,
        glow: float = 0.0,
    ) -> None:
        """Add a box turned by `angle` degrees about an upright hinge at a position in fractions.

        The box's middle before turning, from the hinge, and its half extents are given in metres.
        """
        turn = self._turn @ yaw_matrix(angle)
        center = self.metric(hinge) + turn @ np.asarray(offset, dtype=float)
        self.parts.append(
            ShapePart(Form.BOX, center, tuple(metres), color, material, turn, emission=glow)
        )
