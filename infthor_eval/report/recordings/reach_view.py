"""An arm and objects near it, from above and the side; the agent looks to the right in both."""

from PIL import Image, ImageDraw

from infthor_eval.manipulation.recorded.replay_frames import NearbyObject, Place, Reach
from infthor_eval.report.recordings.canvas import NAMED_EDGE, OVERSAMPLING, shape_look
from infthor_eval.report.recordings.fonts import Font, font

# pixels
_GAP = 12
_HEAD = 22
_LEGEND = 30
_PAPER = "#f3f4f6"
_INK = "#222222"
_ARM = "#555555"
_HAND = "#0072B2"
_SPHERE = (0, 114, 178, 40)
_PATH = "#56B4E9"
_TITLES = ("from above", "from the side")
_PanePoint = tuple[float, float]  # metres: to the right in the pane, and up


def draw_reach(reach: Reach, size: int) -> Image.Image:
    """Draw the two views, as a square of `size` pixels."""
    picture = Image.new("RGB", (size, size), "white")
    high = (size - _LEGEND - _GAP) // 2
    for number, title in enumerate(_TITLES):
        pane = _Pane(reach, size, high, is_above=number == 0)
        picture.paste(pane.draw(title), (0, number * (high + _GAP)))
    _write_legend(ImageDraw.Draw(picture), size)
    return picture


class _Pane:
    """One view."""

    def __init__(self, reach: Reach, wide: int, high: int, *, is_above: bool) -> None:
        self._reach = reach
        self._size = (wide, high)
        self._is_above = is_above
        # Objects in front of the arm or behind it would hide it.
        self._items = [
            nearby for nearby in reach.objects if _is_in_view(nearby, reach, is_above=is_above)
        ]
        corners = [self._flat(reach.low), self._flat(reach.high)]
        across, upward = zip(*corners, strict=True)
        left, right = sorted(across)
        bottom, top = sorted(upward)
        # One scale in both views, so that lengths can be compared.
        rises = [reach.high[0] - reach.low[0], reach.high[2] - reach.low[2]]
        self._per_metre = min(wide / (right - left), (high - _HEAD) / max(rises))
        self._middle = (left + right) / 2, (bottom + top) / 2

    def draw(self, title: str) -> Image.Image:
        large = Image.new(
            "RGB", (self._size[0] * OVERSAMPLING, self._size[1] * OVERSAMPLING), _PAPER
        )
        pen = ImageDraw.Draw(large, "RGBA")
        # Large objects first, those that the instruction names last, on top.
        for nearby in sorted(self._items, key=lambda nearby: (nearby.is_named, -_size(nearby))):
            pen.polygon(self._outline(nearby), **shape_look(is_named=nearby.is_named))
        self._draw_arm(pen)
        picture = large.resize(self._size, Image.Resampling.BOX)
        words = ImageDraw.Draw(picture)
        self._write_names(words)
        words.rectangle((0, 0, self._size[0], _HEAD - 2), fill="white")
        words.text((2, _HEAD / 2 - 1), title, font=font(13), fill=_INK, anchor="lm")
        return picture

    def _draw_arm(self, pen: ImageDraw.ImageDraw) -> None:
        reach = self._reach
        hand = self._fine(reach.hand)
        radius = reach.radius * self._per_metre * OVERSAMPLING
        pen.circle(hand, radius, fill=_SPHERE, outline=_HAND, width=OVERSAMPLING)
        if len(reach.path) > 1:
            path = [self._fine(position) for position in reach.path]
            pen.line(path, fill=_PATH, width=4 * OVERSAMPLING, joint="curve")
        joints = [self._fine(joint) for joint in reach.joints]
        pen.line([*joints, hand], fill=_ARM, width=3 * OVERSAMPLING, joint="curve")
        for position in joints:
            pen.circle(position, 4 * OVERSAMPLING, fill=_ARM)
        pen.circle(hand, 6 * OVERSAMPLING, fill=_HAND)

    def _write_names(self, pen: ImageDraw.ImageDraw) -> None:
        """Write names in their objects; beside them if small and named by the instruction."""
        occupied: list[tuple[float, float]] = []
        for nearby in sorted(self._items, key=lambda nearby: not nearby.is_named):
            face = font(13, "-Bold") if nearby.is_named else font(12)
            position = self._name_place(nearby, face)
            if position is None or any(
                abs(position[0] - x) < 90 and abs(position[1] - y) < 16 for x, y in occupied
            ):
                continue
            occupied.append(position)
            pen.text(
                position,
                nearby.name,
                font=face,
                fill=_INK,
                anchor="mm",
                stroke_width=2,
                stroke_fill="white",
            )

    def _name_place(self, nearby: NearbyObject, face: Font) -> tuple[float, float] | None:
        xs, ys = zip(
            *((x / OVERSAMPLING, y / OVERSAMPLING) for x, y in self._outline(nearby)), strict=True
        )
        left, right = max(min(xs), 0), min(max(xs), self._size[0])
        top, bottom = max(min(ys), _HEAD), min(max(ys), self._size[1])
        half = face.getlength(nearby.name) / 2 + 4
        if right <= left or bottom <= top or (not nearby.is_named and right - left < 2 * half):
            return None
        x = min(max((left + right) / 2, half), self._size[0] - half)
        if not nearby.is_named or (right - left >= 2 * half and bottom - top >= 16):
            return x, (top + bottom) / 2
        return x, top - 10 if top > _HEAD + 20 else bottom + 10

    def _outline(self, nearby: NearbyObject) -> list[tuple[float, float]]:
        if self._is_above:
            return [self._fine((*corner, 0.0)) for corner in nearby.corners]
        depths = [ahead for _, ahead in nearby.corners]
        near, far = min(depths), max(depths)
        corners = ((near, nearby.low), (near, nearby.high), (far, nearby.high), (far, nearby.low))
        return [self._fine((0.0, ahead, height)) for ahead, height in corners]

    def _flat(self, position: Place) -> _PanePoint:
        right, ahead, up = position
        return (ahead, -right) if self._is_above else (ahead, up)

    def _fine(self, position: Place) -> tuple[float, float]:
        """Return a point in the oversampled picture."""
        x, y = self._flat(position)
        wide, high = self._size
        across = wide / 2 + (x - self._middle[0]) * self._per_metre
        down = _HEAD + (high - _HEAD) / 2 - (y - self._middle[1]) * self._per_metre
        return across * OVERSAMPLING, down * OVERSAMPLING


def _is_in_view(nearby: NearbyObject, reach: Reach, *, is_above: bool) -> bool:
    """Return whether an object is at the depth of the episode."""
    if is_above:
        return nearby.low <= reach.high[2] and reach.low[2] <= nearby.high
    across = [right for right, _ in nearby.corners]
    return min(across) <= reach.high[0] and reach.low[0] <= max(across)


def _size(nearby: NearbyObject) -> float:
    spans = (max(values) - min(values) for values in zip(*nearby.corners, strict=True))
    return (nearby.high - nearby.low) * sum(spans)


def _write_legend(pen: ImageDraw.ImageDraw, size: int) -> None:
    x, y = 4.0, size - _LEGEND / 2
    entries = (
        ("hand and its sphere", _HAND),
        ("its path", _PATH),
        ("arm", _ARM),
        ("named object", NAMED_EDGE),
    )
    for text, colour in entries:
        pen.ellipse((x, y - 6, x + 12, y + 6), fill=colour)
        pen.text((x + 18, y), text, font=font(13), fill=_INK, anchor="lm")
        x += 38 + font(13).getlength(text)
