"""A map of a room with the agent in it."""

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from PIL import Image, ImageDraw

from infthor_eval.plans.recorded.replay_frames import (
    FloorPose,
    MapObject,
    PlanObservation,
    Point,
    RoomMap,
)
from infthor_eval.report.recordings.canvas import FURNITURE, NAMED_EDGE, OVERSAMPLING, shape_look
from infthor_eval.report.recordings.fonts import Font, font

_CELL = 0.25  # metres
# pixels
_MARGIN = 14
_LEGEND = 34
_RING = 12
# metres and degrees: where objects count as visible in AI2-THOR
_REACH = 1.5
_HALF_FIELD = 30
_OUTSIDE = "#e9ebee"
_FLOOR = "#ffffff"
_GRID = "#e3e3e3"
_AGENT = "#0072B2"
_SEEN = (0, 114, 178, 40)
_PATH = "#56B4E9"
_GOAL = "#009E73"
_INK = "#222222"
_PARTS = re.compile(r"[A-Z]?[^A-Z]+|[A-Z]+")  # words of a type's name: "SideTable"


def draw_map(observation: PlanObservation, size: int) -> Image.Image:
    """Draw an observation from above, as a square of `size` pixels."""
    scale = _Scale(observation.room, (observation.agent.at, *observation.walked), size)
    large = Image.new("RGB", (size * OVERSAMPLING, size * OVERSAMPLING), _OUTSIDE)
    pen = ImageDraw.Draw(large, "RGBA")
    _draw_room(pen, observation.room, scale)
    _draw_path(pen, observation.walked, scale)
    if observation.room.goal is not None:
        _draw_arrow(pen, observation.room.goal, scale, fill=None, edge=_GOAL, width=3)
    _draw_agent(pen, observation.agent, scale)
    legend = list(_legend(observation))
    _draw_legend(pen, legend, size)
    picture = large.resize((size, size), Image.Resampling.BOX)
    words = ImageDraw.Draw(picture)
    _write_names(words, observation, scale, size)
    for x, text, _ in legend:
        words.text((x + 18, size - _LEGEND / 2), text, font=font(13), fill=_INK, anchor="lm")
    return picture


class _Scale:
    """Converts metres to pixels; +z is up."""

    def __init__(self, room: RoomMap, points: Iterable[Point], size: int) -> None:
        corners = [
            *points,
            *(corner for shape in room.objects for corner in (shape.low, shape.high)),
        ]
        corners += [
            (x + shift, z + shift) for x, z in room.floor for shift in (-_CELL / 2, _CELL / 2)
        ]
        xs = [x for x, _ in corners]
        zs = [z for _, z in corners]
        wide = size - 2 * _MARGIN
        high = size - 2 * _MARGIN - _LEGEND
        self.per_metre = min(
            wide / max(max(xs) - min(xs), _CELL), high / max(max(zs) - min(zs), _CELL)
        )
        self._middle = (max(xs) + min(xs)) / 2, (max(zs) + min(zs)) / 2
        self._place = size / 2, (size - _LEGEND) / 2

    def at(self, point: Point) -> Point:
        """Return a point in the final picture."""
        x = self._place[0] + (point[0] - self._middle[0]) * self.per_metre
        return x, self._place[1] - (point[1] - self._middle[1]) * self.per_metre

    def fine(self, point: Point) -> Point:
        """Return a point in the oversampled picture."""
        x, y = self.at(point)
        return x * OVERSAMPLING, y * OVERSAMPLING

    def box(self, low: Point, high: Point) -> tuple[float, float, float, float]:
        """Return a box in the oversampled picture: left, top, right, bottom."""
        left, bottom = self.fine(low)
        right, top = self.fine(high)
        return left, top, right, bottom


def _draw_room(pen: ImageDraw.ImageDraw, room: RoomMap, scale: _Scale) -> None:
    for x, z in room.floor:
        corners = (x - _CELL / 2, z - _CELL / 2), (x + _CELL / 2, z + _CELL / 2)
        pen.rectangle(scale.box(*corners), fill=_FLOOR, outline=_GRID)
    # Large objects first, those that the plan names last, on top.
    for shape in sorted(room.objects, key=lambda shape: (shape.is_named, -_area(shape))):
        look = shape_look(is_named=shape.is_named)
        pen.rectangle(scale.box(shape.low, shape.high), **look)
        if shape.is_named:
            _draw_ring(pen, shape, scale)


def _area(shape: MapObject) -> float:
    return (shape.high[0] - shape.low[0]) * (shape.high[1] - shape.low[1])


def _draw_ring(pen: ImageDraw.ImageDraw, shape: MapObject, scale: _Scale) -> None:
    """Draw a ring around an object that is too small to be noticed."""
    half = _RING * OVERSAMPLING
    left, top, right, bottom = scale.box(shape.low, shape.high)
    if max(right - left, bottom - top) < 2 * half:
        middle = scale.fine(_middle(shape))
        pen.circle(middle, half, outline=NAMED_EDGE, width=2 * OVERSAMPLING)


def _draw_path(pen: ImageDraw.ImageDraw, walked: Sequence[Point], scale: _Scale) -> None:
    points = [scale.fine(point) for point in walked]
    if len(points) > 1:
        pen.line(points, fill=_PATH, width=4 * OVERSAMPLING, joint="curve")
    for point in points:
        pen.circle(point, 4 * OVERSAMPLING, fill=_PATH)


def _draw_agent(pen: ImageDraw.ImageDraw, agent: FloorPose, scale: _Scale) -> None:
    x, y = scale.fine(agent.at)
    reach = _REACH * scale.per_metre * OVERSAMPLING
    ahead = agent.facing - 90  # Pillow measures angles clockwise from the right
    box = (x - reach, y - reach, x + reach, y + reach)
    pen.pieslice(box, ahead - _HALF_FIELD, ahead + _HALF_FIELD, fill=_SEEN, outline=None)
    _draw_arrow(pen, agent, scale, fill=_AGENT, edge="white", width=1)


def _draw_arrow(
    pen: ImageDraw.ImageDraw,
    pose: FloorPose,
    scale: _Scale,
    fill: str | None,
    edge: str,
    width: int,
) -> None:
    """Draw an arrow head that points where a pose faces."""
    x, y = scale.fine(pose.at)
    parts = ((0, 1.0), (140, 1.0), (180, 0.5), (220, 1.0))
    turned = [
        (math.radians(pose.facing + angle), length * (17 * OVERSAMPLING)) for angle, length in parts
    ]
    corners = [
        (x + length * math.sin(angle), y - length * math.cos(angle)) for angle, length in turned
    ]
    pen.polygon(corners, fill=fill, outline=edge, width=width * OVERSAMPLING)


def _write_names(
    pen: ImageDraw.ImageDraw, observation: PlanObservation, scale: _Scale, size: int
) -> None:
    """Write the names of the objects that the plan names, and of furniture where there is room.

    Furniture that stands on other furniture has no name: the names would cover each other.
    """
    agent = scale.at(observation.agent.at)
    occupied: list[_Area] = [(agent[0] - 16, agent[1] - 16, agent[0] + 16, agent[1] + 16)]
    named: list[MapObject] = []
    for shape in sorted(
        observation.room.objects, key=lambda shape: (shape.is_named, _area(shape)), reverse=True
    ):
        if not shape.is_named and any(_is_on(shape, other) for other in named):
            continue
        words = _name(shape, scale, size)
        if words is None or any(
            _overlap(words.area, other) for other in occupied[shape.is_named :]
        ):
            continue
        occupied.append(words.area)
        named.append(shape)
        if not words.is_inside:
            x, y = scale.at(_middle(shape))
            occupied.append((x - _RING, y - _RING, x + _RING, y + _RING))
        x, y = (words.area[0] + words.area[2]) / 2, (words.area[1] + words.area[3]) / 2
        halo = FURNITURE if words.is_inside and not shape.is_named else "white"
        pen.multiline_text(
            (x, y), words.text, font=words.face, fill=_INK, anchor="mm", align="center", spacing=1,
            stroke_width=2, stroke_fill=halo,
        )  # fmt: skip


_Area = tuple[float, float, float, float]  # left, top, right, bottom


class _Name(NamedTuple):
    """A name and its place."""

    text: str
    face: Font
    area: _Area
    is_inside: bool


def _name(shape: MapObject, scale: _Scale, size: int) -> _Name | None:
    """Place a name in the object's box; beside it if the plan names it and the box is small."""
    face = font(14, "-Bold") if shape.is_named else font(12)
    x, y = scale.at(_middle(shape))
    wide = (shape.high[0] - shape.low[0]) * scale.per_metre
    high = (shape.high[1] - shape.low[1]) * scale.per_metre
    for text in (shape.name, "\n".join(_PARTS.findall(shape.name))):
        lines = text.split("\n")
        half = max(map(face.getlength, lines)) / 2
        tall = len(lines) * 7.5
        if 2 * half <= wide + 8 and 2 * tall <= high + 4:
            return _Name(text, face, (x - half, y - tall, x + half, y + tall), True)
    if not shape.is_named:
        return None
    half = face.getlength(shape.name) / 2
    x = min(max(x, half + 4), size - half - 4)
    offset = max(high / 2 + 12, 24)
    y += offset if y < size / 2 else -offset
    return _Name(shape.name, face, (x - half, y - 8, x + half, y + 8), False)


def _is_on(shape: MapObject, other: MapObject) -> bool:
    middle = _middle(shape)
    return all(
        low <= coordinate <= high
        for low, coordinate, high in zip(other.low, middle, other.high, strict=True)
    )


def _overlap(one: _Area, other: _Area) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _middle(shape: MapObject) -> Point:
    return (shape.low[0] + shape.high[0]) / 2, (shape.low[1] + shape.high[1]) / 2


def _draw_legend(
    pen: ImageDraw.ImageDraw, legend: Sequence[tuple[float, str, str]], size: int
) -> None:
    """Draw the legend's dots; its letters need no oversampling, and go into the final picture."""
    fine = size * OVERSAMPLING
    radius = 6 * OVERSAMPLING
    y = (size - _LEGEND / 2) * OVERSAMPLING
    pen.rectangle((0, fine - _LEGEND * OVERSAMPLING, fine, fine), fill="white")
    for left, _, colour in legend:
        x = left * OVERSAMPLING
        pen.ellipse((x, y - radius, x + 2 * radius, y + radius), fill=colour)


def _legend(observation: PlanObservation) -> Iterator[tuple[float, str, str]]:
    """Yield left edge, text and colour of each entry of the legend, from left to right."""
    entries = [("agent", _AGENT), ("path in this plan", _PATH)]
    entries += [("where the expert ended", _GOAL)] if observation.room.goal is not None else []
    entries += (
        [("what the plan names", NAMED_EDGE)]
        if any(shape.is_named for shape in observation.room.objects)
        else []
    )
    x = 6.0
    for text, colour in entries:
        yield x, text, colour
        x += 36 + font(13).getlength(text)
