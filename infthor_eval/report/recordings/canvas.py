"""The pictures of a recording, whatever it shows: two panes beside each other, beneath them words and numbers."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from PIL import Image, ImageDraw

from infthor_eval.report.recordings.fonts import fitted, font, lines_of, one_line

__all__ = [
    "BAD",
    "END_HELD",
    "FAINT",
    "GOOD",
    "INK",
    "PANE",
    "SIZE",
    "TITLE_HELD",
    "WARN",
    "Line",
    "card",
    "held",
    "page",
    "write_bar",
    "write_in_hand",
    "write_lines",
    "write_numbers",
]

SIZE = (1248, 896)  # of a picture; multiples of 16, as codecs like it
TITLE_HELD, END_HELD = 3, 3  # pictures that a title and an end are shown for
PANE = 600  # width and height of a pane
_EDGE, _TOP = 16, 40
_BELOW = _TOP + PANE + 16  # where the words begin
_LABELS, _WORDS, _RIGHT = _EDGE, 150, 880  # columns
INK, FAINT, _PAPER = "#1c1c1c", "#6b6b6b", "#ffffff"
GOOD, BAD, WARN, _BAR = "#1a7f37", "#c1272d", "#9a5b00", "#0072B2"
_ROW = 29  # pixels of a number's row


class Line(NamedTuple):
    """A line of the words: what it is called, what it says, how."""

    label: str
    text: str
    size: int = 16
    style: str = ""
    colour: str = INK
    most: int = 1


def held(picture: Image.Image, *, is_end: bool) -> Iterator[Image.Image]:
    """A picture as often as it is shown."""
    yield from [picture] * (END_HELD if is_end else 1)


def card(heading: str, lines: Iterable[Line]) -> Image.Image:
    """A page of words alone, before what they tell of is shown."""
    picture, pen = _blank(heading)
    y = 270.0
    for line in lines:
        face = font(line.size, line.style)
        for part in lines_of(line.text, face, SIZE[0] - 160, line.most):
            pen.text((SIZE[0] / 2, y), part, font=face, fill=line.colour, anchor="ma")
            y += line.size * 1.4
        y += 18
    return picture


def page(heading: str, left: Image.Image, right: Image.Image) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    """A picture with its two panes, and a pen for what follows beneath."""
    picture, pen = _blank(heading)
    picture.paste(left.resize((PANE, PANE), Image.Resampling.BICUBIC), (_EDGE, _TOP))
    picture.paste(right, (_EDGE + PANE + _EDGE, _TOP))
    return picture, pen


def _blank(heading: str) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    picture = Image.new("RGB", SIZE, _PAPER)
    pen = ImageDraw.Draw(picture)
    face = font(15)
    text = fitted(one_line(heading), face, SIZE[0] - 2 * _EDGE)
    pen.text((_EDGE, _TOP / 2), text, font=face, fill=FAINT, anchor="lm")
    return picture, pen


def write_lines(pen: ImageDraw.ImageDraw, lines: Iterable[Line]) -> None:
    """What is told, on the left."""
    y = float(_BELOW)
    for line in lines:
        face = font(line.size, line.style)
        parts = lines_of(one_line(line.text), face, _RIGHT - _WORDS - 24, line.most)
        pen.text((_LABELS, y + line.size), line.label, font=font(14), fill=FAINT, anchor="ls")
        for part in parts or [""]:
            pen.text((_WORDS, y + line.size), part, font=face, fill=line.colour, anchor="ls")
            y += line.size * 1.3
        y += 5


def write_numbers(pen: ImageDraw.ImageDraw, numbers: Sequence[tuple[str, str]]) -> None:
    """Three of them, each with what it is called, on the right."""
    y = float(_BELOW)
    for label, text in numbers:
        pen.text((_RIGHT, y + 18), label, font=font(14), fill=FAINT, anchor="ls")
        pen.text((SIZE[0] - _EDGE, y + 18), text, font=font(18, "-Bold"), fill=INK, anchor="rs")
        y += _ROW


def write_bar(pen: ImageDraw.ImageDraw, share: float) -> None:
    """A bar beneath three numbers, filled by a share of 0 to 1."""
    y, left, right = _BELOW + 3.0 * _ROW, _RIGHT, SIZE[0] - _EDGE
    pen.rectangle((left, y, right, y + 10), fill="#e3e6ea")
    if share:
        pen.rectangle((left, y, left + share * (right - left), y + 10), fill=_BAR)


def write_in_hand(pen: ImageDraw.ImageDraw, things: Sequence[str], ending: str, *, is_good: bool) -> None:
    """What is held, and how it ended; nothing of that where it goes on."""
    y = _BELOW + 112.0
    named = ", ".join(things)
    pen.text((_RIGHT, y + 16), "in hand", font=font(14), fill=FAINT, anchor="ls")
    text = fitted(one_line(named) or "nothing", font(16), SIZE[0] - _EDGE - _RIGHT - 90)
    pen.text((SIZE[0] - _EDGE, y + 16), text, font=font(16), fill=INK if named else FAINT, anchor="rs")
    if not ending:
        return
    box = (_RIGHT, y + 34, SIZE[0] - _EDGE, y + 76)
    pen.rounded_rectangle(box, 8, fill=GOOD if is_good else BAD)
    face = font(18, "-Bold")
    words = fitted(one_line(ending), face, box[2] - box[0] - 20)
    pen.text(((box[0] + box[2]) / 2, y + 55), words, font=face, fill="white", anchor="mm")
