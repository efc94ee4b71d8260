"""An arm and what is near it, from above and from the side; the agent looks to the right in both."""

from collections.abc import Sequence

from PIL import Image, ImageDraw

from infthor_eval.manipulation.replay_frames import NearbyObject, Place, Reach
from infthor_eval.report.recordings.fonts import Font, font

__all__ = ["draw_reach"]

_FINER = 2  # drawn so many times larger and reduced: smooth edges
_GAP, _HEAD, _LEGEND = 12, 22, 30  # pixels
_PAPER, _INK = "#f3f4f6", "#222222"
_FURNITURE, _EDGE = "#d9cbb3", "#9c8a6a"
_NAMED, _NAMED_EDGE = "#f8c89b", "#D55E00"  # Okabe and Ito's colours, as in the figures
_ARM, _HAND, _SPHERE, _WAY = "#555555", "#0072B2", (0, 114, 178, 40), "#56B4E9"
_TITLES = ("from above", "from the side")
_Point = tuple[float, float]  # metres: to the right of the pane, and upwards in it


def draw_reach(reach: Reach, size: int) -> Image.Image:
    """The two views of a moment, a square of so many pixels."""
    picture = Image.new("RGB", (size, size), "white")
    high = (size - _LEGEND - _GAP) // 2
    for number, title in enumerate(_TITLES):
        pane = _Pane(reach, size, high, is_above=number == 0)
        picture.paste(pane.drawn(title), (0, number * (high + _GAP)))
    _write_legend(ImageDraw.Draw(picture), size)
    return picture


class _Pane:
    """One view."""

    def __init__(self, reach: Reach, wide: int, high: int, *, is_above: bool) -> None:
        self._reach, self._size, self._is_above = reach, (wide, high), is_above
        # What lies beside what is looked at would hide it.
        self._solids = [solid for solid in reach.objects if _meets(solid, reach, is_above=is_above)]
        corners = [self._flat(reach.low), self._flat(reach.high)]
        (left, right), (bottom, top) = (sorted(values) for values in zip(*corners, strict=True))
        # One scale in both views, so that lengths can be compared.
        rises = [reach.high[0] - reach.low[0], reach.high[2] - reach.low[2]]
        self._per_metre = min(wide / (right - left), (high - _HEAD) / max(rises))
        self._middle = (left + right) / 2, (bottom + top) / 2

    def drawn(self, title: str) -> Image.Image:
        """The view, with its title."""
        large = Image.new("RGB", (self._size[0] * _FINER, self._size[1] * _FINER), _PAPER)
        pen = ImageDraw.Draw(large, "RGBA")
        for solid in _in_order(self._solids):
            fill, edge, width = (_NAMED, _NAMED_EDGE, 3) if solid.is_named else (_FURNITURE, _EDGE, 1)
            pen.polygon(self._outline(solid), fill=fill, outline=edge, width=width * _FINER)
        self._draw_arm(pen)
        picture = large.resize(self._size, Image.Resampling.BOX)
        words = ImageDraw.Draw(picture)
        self._write_names(words)
        words.rectangle((0, 0, self._size[0], _HEAD - 2), fill="white")
        words.text((2, _HEAD / 2 - 1), title, font=font(13), fill=_INK, anchor="lm")
        return picture

    def _draw_arm(self, pen: ImageDraw.ImageDraw) -> None:
        reach = self._reach
        x, y = self._fine(reach.hand)
        radius = reach.radius * self._per_metre * _FINER
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=_SPHERE, outline=_HAND, width=_FINER)
        if len(reach.path) > 1:
            pen.line([self._fine(place) for place in reach.path], fill=_WAY, width=4 * _FINER, joint="curve")
        joints = [self._fine(joint) for joint in reach.joints]
        pen.line([*joints, (x, y)], fill=_ARM, width=3 * _FINER, joint="curve")
        for place in joints:
            _draw_dot(pen, place, 4 * _FINER, _ARM)
        _draw_dot(pen, (x, y), 6 * _FINER, _HAND)

    def _write_names(self, pen: ImageDraw.ImageDraw) -> None:
        """In the middle of what can be seen of each thing; beside what is small, if the instruction is about it."""
        taken: list[tuple[float, float]] = []
        for solid in sorted(self._solids, key=lambda solid: not solid.is_named):
            face = font(13, "-Bold") if solid.is_named else font(12)
            place = self._name_place(solid, face)
            if place is None or any(abs(place[0] - x) < 90 and abs(place[1] - y) < 16 for x, y in taken):
                continue
            taken.append(place)
            pen.text(place, solid.name, font=face, fill=_INK, anchor="mm", stroke_width=2, stroke_fill="white")

    def _name_place(self, solid: NearbyObject, face: Font) -> tuple[float, float] | None:
        xs, ys = zip(*((x / _FINER, y / _FINER) for x, y in self._outline(solid)), strict=True)
        left, right = max(min(xs), 0), min(max(xs), self._size[0])
        top, bottom = max(min(ys), _HEAD), min(max(ys), self._size[1])
        half = face.getlength(solid.name) / 2 + 4
        if right <= left or bottom <= top or (not solid.is_named and right - left < 2 * half):
            return None
        x = min(max((left + right) / 2, half), self._size[0] - half)
        if not solid.is_named or (right - left >= 2 * half and bottom - top >= 16):
            return x, (top + bottom) / 2
        return x, top - 10 if top > _HEAD + 20 else bottom + 10

    def _outline(self, solid: NearbyObject) -> list[tuple[float, float]]:
        if self._is_above:
            return [self._fine((*corner, 0.0)) for corner in solid.corners]
        near, far = (choose(ahead for _, ahead in solid.corners) for choose in (min, max))
        corners = ((near, solid.low), (near, solid.high), (far, solid.high), (far, solid.low))
        return [self._fine((0.0, ahead, height)) for ahead, height in corners]

    def _flat(self, place: Place) -> _Point:
        right, ahead, up = place
        return (ahead, -right) if self._is_above else (ahead, up)

    def _fine(self, place: Place) -> tuple[float, float]:
        """In the large picture."""
        x, y = self._flat(place)
        wide, high = self._size
        across = wide / 2 + (x - self._middle[0]) * self._per_metre
        down = _HEAD + (high - _HEAD) / 2 - (y - self._middle[1]) * self._per_metre
        return across * _FINER, down * _FINER


def _meets(solid: NearbyObject, reach: Reach, *, is_above: bool) -> bool:
    """Whether a thing is as deep in the picture as what it must hold."""
    if is_above:
        return solid.low <= reach.high[2] and reach.low[2] <= solid.high
    across = [right for right, _ in solid.corners]
    return min(across) <= reach.high[0] and reach.low[0] <= max(across)


def _draw_dot(pen: ImageDraw.ImageDraw, place: tuple[float, float], half: float, colour: str) -> None:
    x, y = place
    pen.ellipse((x - half, y - half, x + half, y + half), fill=colour)


def _in_order(solids: Sequence[NearbyObject]) -> list[NearbyObject]:
    """The large ones below the small ones, and what the instruction is about on top."""
    return sorted(solids, key=lambda solid: (solid.is_named, -_size(solid)))


def _size(solid: NearbyObject) -> float:
    spans = (max(values) - min(values) for values in zip(*solid.corners, strict=True))
    return (solid.high - solid.low) * sum(spans)


def _write_legend(pen: ImageDraw.ImageDraw, size: int) -> None:
    x, y = 4.0, size - _LEGEND / 2
    entries = (("hand and its sphere", _HAND), ("its way", _WAY), ("arm", _ARM), ("what it is about", _NAMED_EDGE))
    for text, colour in entries:
        pen.ellipse((x, y - 6, x + 12, y + 6), fill=colour)
        pen.text((x + 18, y), text, font=font(13), fill=_INK, anchor="lm")
        x += 38 + font(13).getlength(text)
