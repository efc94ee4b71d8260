"""A room from above, with the agent in it."""

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from PIL import Image, ImageDraw

from infthor_eval.plans.replay_frames import FloorPose, MapObject, PlanObservation, Point, RoomMap
from infthor_eval.report.recordings.fonts import Font, font

__all__ = ["draw_map"]

_FINER = 2  # drawn so many times larger and reduced: smooth edges
_CELL = 0.25  # metres
_MARGIN, _LEGEND, _RING = 14, 34, 12  # pixels
_REACH, _HALF_FIELD = 1.5, 30  # metres and degrees: what the agent can see well enough to act on
_OUTSIDE, _FLOOR, _GRID = "#e9ebee", "#ffffff", "#e3e3e3"
_FURNITURE, _EDGE = "#d9cbb3", "#9c8a6a"
_NAMED, _NAMED_EDGE = "#f8c89b", "#D55E00"  # Okabe and Ito's colours, as in the figures
_AGENT, _SEEN, _WAY, _GOAL = "#0072B2", (0, 114, 178, 40), "#56B4E9", "#009E73"
_INK = "#222222"
_PARTS = re.compile(r"[A-Z]?[^A-Z]+|[A-Z]+")  # of a type's name: "SideTable"


def draw_map(observation: PlanObservation, size: int) -> Image.Image:
    """The map of a moment, a square of so many pixels."""
    scale = _Scale(observation.room, (observation.agent.at, *observation.walked), size)
    large = Image.new("RGB", (size * _FINER, size * _FINER), _OUTSIDE)
    pen = ImageDraw.Draw(large, "RGBA")
    _draw_room(pen, observation.room, scale)
    _draw_way(pen, observation.walked, scale)
    if observation.room.goal is not None:
        _draw_arrow(pen, observation.room.goal, scale, fill=None, edge=_GOAL, width=3)
    _draw_agent(pen, observation.agent, scale)
    _draw_legend(pen, observation, size)
    picture = large.resize((size, size), Image.Resampling.BOX)
    words = ImageDraw.Draw(picture)
    _write_names(words, observation, scale, size)
    _write_legend(words, observation, size)
    return picture


class _Scale:
    """Metres to the pixels of the large picture; +z is up."""

    def __init__(self, room: RoomMap, points: Iterable[Point], size: int) -> None:
        corners = [*points, *(corner for thing in room.objects for corner in (thing.low, thing.high))]
        corners += [(x + off, z + off) for x, z in room.floor for off in (-_CELL / 2, _CELL / 2)]
        xs, zs = [x for x, _ in corners], [z for _, z in corners]
        wide, high = size - 2 * _MARGIN, size - 2 * _MARGIN - _LEGEND
        self.per_metre = min(wide / max(max(xs) - min(xs), _CELL), high / max(max(zs) - min(zs), _CELL))
        self._middle = (max(xs) + min(xs)) / 2, (max(zs) + min(zs)) / 2
        self._place = size / 2, (size - _LEGEND) / 2

    def at(self, point: Point) -> Point:
        """In the picture as it is in the end."""
        x = self._place[0] + (point[0] - self._middle[0]) * self.per_metre
        return x, self._place[1] - (point[1] - self._middle[1]) * self.per_metre

    def fine(self, point: Point) -> Point:
        """In the large one."""
        x, y = self.at(point)
        return x * _FINER, y * _FINER

    def box(self, low: Point, high: Point) -> tuple[float, float, float, float]:
        """A box in the large one: left, top, right, bottom."""
        left, bottom = self.fine(low)
        right, top = self.fine(high)
        return left, top, right, bottom


def _draw_room(pen: ImageDraw.ImageDraw, room: RoomMap, scale: _Scale) -> None:
    for x, z in room.floor:
        corners = (x - _CELL / 2, z - _CELL / 2), (x + _CELL / 2, z + _CELL / 2)
        pen.rectangle(scale.box(*corners), fill=_FLOOR, outline=_GRID)
    for thing in _in_order(room.objects):
        fill, edge, width = (_NAMED, _NAMED_EDGE, 3) if thing.is_named else (_FURNITURE, _EDGE, 1)
        pen.rectangle(scale.box(thing.low, thing.high), fill=fill, outline=edge, width=width * _FINER)
        if thing.is_named:
            _draw_ring(pen, thing, scale)


def _in_order(things: Sequence[MapObject]) -> list[MapObject]:
    """The large ones below the small ones, and what the plan is about on top."""
    return sorted(things, key=lambda thing: (thing.is_named, -_area(thing)))


def _area(thing: MapObject) -> float:
    return (thing.high[0] - thing.low[0]) * (thing.high[1] - thing.low[1])


def _draw_ring(pen: ImageDraw.ImageDraw, thing: MapObject, scale: _Scale) -> None:
    """Around a thing too small to be found."""
    half = _RING * _FINER
    left, top, right, bottom = scale.box(thing.low, thing.high)
    if max(right - left, bottom - top) < 2 * half:
        x, y = scale.fine(_middle(thing))
        pen.ellipse((x - half, y - half, x + half, y + half), outline=_NAMED_EDGE, width=2 * _FINER)


def _draw_way(pen: ImageDraw.ImageDraw, walked: Sequence[Point], scale: _Scale) -> None:
    places = [scale.fine(point) for point in walked]
    if len(places) > 1:
        pen.line(places, fill=_WAY, width=4 * _FINER, joint="curve")
    half = 4 * _FINER
    for x, y in places:
        pen.ellipse((x - half, y - half, x + half, y + half), fill=_WAY)


def _draw_agent(pen: ImageDraw.ImageDraw, agent: FloorPose, scale: _Scale) -> None:
    x, y = scale.fine(agent.at)
    reach = _REACH * scale.per_metre * _FINER
    ahead = agent.facing - 90  # Pillow counts from the right, downwards
    pen.pieslice(
        (x - reach, y - reach, x + reach, y + reach), ahead - _HALF_FIELD, ahead + _HALF_FIELD, fill=_SEEN, outline=None
    )
    _draw_arrow(pen, agent, scale, fill=_AGENT, edge="white", width=1)


def _draw_arrow(
    pen: ImageDraw.ImageDraw, pose: FloorPose, scale: _Scale, fill: str | None, edge: str, width: int
) -> None:
    x, y = scale.fine(pose.at)
    pen.polygon(_arrow(x, y, pose.facing, 17 * _FINER), fill=fill, outline=edge, width=width * _FINER)


def _arrow(x: float, y: float, facing: float, size: float) -> list[Point]:
    """A dart that points where somebody faces."""
    parts = ((0, 1.0), (140, 1.0), (180, 0.5), (220, 1.0))
    turned = [(math.radians(facing + angle), length * size) for angle, length in parts]
    return [(x + length * math.sin(angle), y - length * math.cos(angle)) for angle, length in turned]


def _write_names(pen: ImageDraw.ImageDraw, observation: PlanObservation, scale: _Scale, size: int) -> None:
    """Names of what the plan is about, and of furniture as far as there is room; what stands on it has none."""
    agent = scale.at(observation.agent.at)
    taken: list[_Area] = [(agent[0] - 16, agent[1] - 16, agent[0] + 16, agent[1] + 16)]
    told: list[MapObject] = []
    for thing in sorted(observation.room.objects, key=lambda thing: (thing.is_named, _area(thing)), reverse=True):
        if not thing.is_named and any(_is_on(thing, other) for other in told):
            continue
        words = _name(thing, scale, size)
        if words is None or any(_overlap(words.area, other) for other in taken[thing.is_named :]):
            continue
        taken.append(words.area)
        told.append(thing)
        if not words.is_inside:
            x, y = scale.at(_middle(thing))
            taken.append((x - _RING, y - _RING, x + _RING, y + _RING))
        x, y = (words.area[0] + words.area[2]) / 2, (words.area[1] + words.area[3]) / 2
        halo = _FURNITURE if words.is_inside and not thing.is_named else "white"
        pen.multiline_text(
            (x, y), words.text, font=words.face, fill=_INK, anchor="mm", align="center", spacing=1,
            stroke_width=2, stroke_fill=halo,
        )  # fmt: skip


_Area = tuple[float, float, float, float]  # left, top, right, bottom


class _Name(NamedTuple):
    """A name and where it stands."""

    text: str
    face: Font
    area: _Area
    is_inside: bool


def _name(thing: MapObject, scale: _Scale, size: int) -> _Name | None:
    """In the thing's box, in one line or in several; beside it where it is too small and the plan names it."""
    face = font(14, "-Bold") if thing.is_named else font(12)
    x, y = scale.at(_middle(thing))
    wide, high = ((high - low) * scale.per_metre for low, high in zip(thing.low, thing.high, strict=True))
    for text in (thing.name, "\n".join(_PARTS.findall(thing.name))):
        lines = text.split("\n")
        half, tall = max(map(face.getlength, lines)) / 2, len(lines) * 7.5
        if 2 * half <= wide + 8 and 2 * tall <= high + 4:
            return _Name(text, face, (x - half, y - tall, x + half, y + tall), True)
    if not thing.is_named:
        return None
    half = face.getlength(thing.name) / 2
    x = min(max(x, half + 4), size - half - 4)
    off = max(high / 2 + 12, 24)
    y += off if y < size / 2 else -off
    return _Name(thing.name, face, (x - half, y - 8, x + half, y + 8), False)


def _is_on(thing: MapObject, other: MapObject) -> bool:
    middle = _middle(thing)
    return all(low <= place <= high for low, place, high in zip(other.low, middle, other.high, strict=True))


def _overlap(one: _Area, other: _Area) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _middle(thing: MapObject) -> Point:
    return (thing.low[0] + thing.high[0]) / 2, (thing.low[1] + thing.high[1]) / 2


def _legend(observation: PlanObservation) -> list[tuple[str, str]]:
    """What the colours mean."""
    entries = [("agent", _AGENT), ("way in this plan", _WAY)]
    entries += [("where the expert ended", _GOAL)] if observation.room.goal is not None else []
    return entries + (
        [("what the plan names", _NAMED_EDGE)] if any(thing.is_named for thing in observation.room.objects) else []
    )


def _draw_legend(pen: ImageDraw.ImageDraw, observation: PlanObservation, size: int) -> None:
    """The marks; the words follow in the picture as it is in the end."""
    fine, y = size * _FINER, (size - _LEGEND / 2) * _FINER
    pen.rectangle((0, fine - _LEGEND * _FINER, fine, fine), fill="white")
    for x, _, colour in _places(_legend(observation)):
        pen.ellipse((x * _FINER, y - 6 * _FINER, (x + 12) * _FINER, y + 6 * _FINER), fill=colour)


def _write_legend(pen: ImageDraw.ImageDraw, observation: PlanObservation, size: int) -> None:
    for x, text, _ in _places(_legend(observation)):
        pen.text((x + 18, size - _LEGEND / 2), text, font=font(13), fill=_INK, anchor="lm")


def _places(entries: Sequence[tuple[str, str]]) -> Iterator[tuple[float, str, str]]:
    """From left to right: where each begins, its text, its colour."""
    x = 6.0
    for text, colour in entries:
        yield x, text, colour
        x += 36 + font(13).getlength(text)
