"""The layout of a recording's pictures: two panes side by side, text and numbers below them."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from PIL import Image, ImageDraw

from infthor_eval.report.recordings.fonts import break_lines, fit_line, font, one_line

SIZE = (1248, 896)  # of a picture; multiples of 16, as video codecs work in blocks of that size
# pictures that show a title and an end
TITLE_REPEATS = 3
END_REPEATS = 3
PANE = 600  # width and height of a pane
_EDGE = 16
_TOP = 40
_BELOW = _TOP + PANE + 16  # top of the text
# left edges of the columns
_LABELS = _EDGE
_WORDS = 150
_RIGHT = 880
INK = "#1c1c1c"
FAINT = "#6b6b6b"
_PAPER = "#ffffff"
# Colours of maps: Okabe and Ito's, as in the figures, for what the instruction names.
FURNITURE = "#d9cbb3"
_FURNITURE_EDGE = "#9c8a6a"
_NAMED = "#f8c89b"
NAMED_EDGE = "#D55E00"
OVERSAMPLING = 2  # Pillow draws hard edges; drawn larger and reduced they are smooth
GOOD = "#1a7f37"
BAD = "#c1272d"
WARN = "#9a5b00"
_BAR = "#0072B2"
_ROW = 29  # height of a row of numbers


def shape_look(*, is_named: bool) -> dict[str, Any]:
    """Return how Pillow draws a thing on a map: what the instruction names stands out."""
    fill, edge, width = (_NAMED, NAMED_EDGE, 3) if is_named else (FURNITURE, _FURNITURE_EDGE, 1)
    return {"fill": fill, "outline": edge, "width": width * OVERSAMPLING}


class Line(NamedTuple):
    """A line of the text: its label, its words, and their style.

    Attributes:
        label: label on the left; empty for none.
        text: the words.
        size: size of the letters.
        style: style of the font, see `font`.
        colour: colour of the words.
        most: maximum number of lines that the words are broken into.
    """

    label: str
    text: str
    size: int = 16
    style: str = ""
    colour: str = INK
    most: int = 1


def film_pictures(
    frames: Iterable[Any],
    draw_title: Callable[[Any], Image.Image],
    draw: Callable[[Any], Image.Image],
) -> Iterator[Image.Image]:
    """Draw episodes' frames in time order: each with its title before, its end several times."""
    for frame in frames:
        if frame.number == 0:
            yield from [draw_title(frame)] * TITLE_REPEATS
        if frame.observation is not None:
            yield from [draw(frame)] * (END_REPEATS if frame.ending else 1)


def title_card(heading: str, lines: Iterable[Line]) -> Image.Image:
    """Return a picture of text alone, which introduces an episode."""
    picture, pen = _blank(heading)
    y = 270.0
    for line in lines:
        face = font(line.size, line.style)
        for part in break_lines(line.text, face, SIZE[0] - 160, line.most):
            pen.text((SIZE[0] / 2, y), part, font=face, fill=line.colour, anchor="ma")
            y += line.size * 1.4
        y += 18
    return picture


def draw_panes(
    heading: str, left: Image.Image, right: Image.Image
) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    """Return a picture with its two panes, and a pen for the text below them."""
    picture, pen = _blank(heading)
    picture.paste(left.resize((PANE, PANE), Image.Resampling.BICUBIC), (_EDGE, _TOP))
    picture.paste(right, (_EDGE + PANE + _EDGE, _TOP))
    return picture, pen


def _blank(heading: str) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    picture = Image.new("RGB", SIZE, _PAPER)
    pen = ImageDraw.Draw(picture)
    face = font(15)
    text = fit_line(one_line(heading), face, SIZE[0] - 2 * _EDGE)
    pen.text((_EDGE, _TOP / 2), text, font=face, fill=FAINT, anchor="lm")
    return picture, pen


def write_lines(pen: ImageDraw.ImageDraw, lines: Iterable[Line]) -> None:
    """Write lines of text on the left."""
    y = float(_BELOW)
    for line in lines:
        face = font(line.size, line.style)
        parts = break_lines(one_line(line.text), face, _RIGHT - _WORDS - 24, line.most)
        pen.text((_LABELS, y + line.size), line.label, font=font(14), fill=FAINT, anchor="ls")
        for part in parts or [""]:
            pen.text((_WORDS, y + line.size), part, font=face, fill=line.colour, anchor="ls")
            y += line.size * 1.3
        y += 5


def write_numbers(pen: ImageDraw.ImageDraw, numbers: Sequence[tuple[str, str]]) -> None:
    """Write three numbers with their labels on the right."""
    y = float(_BELOW)
    for label, text in numbers:
        pen.text((_RIGHT, y + 18), label, font=font(14), fill=FAINT, anchor="ls")
        pen.text((SIZE[0] - _EDGE, y + 18), text, font=font(18, "-Bold"), fill=INK, anchor="rs")
        y += _ROW


def write_bar(pen: ImageDraw.ImageDraw, share: float) -> None:
    """Draw a bar below the three numbers, filled by a share from 0 to 1."""
    y = _BELOW + 3.0 * _ROW
    left = _RIGHT
    right = SIZE[0] - _EDGE
    pen.rectangle((left, y, right, y + 10), fill="#e3e6ea")
    if share:
        pen.rectangle((left, y, left + share * (right - left), y + 10), fill=_BAR)


def write_in_hand(
    pen: ImageDraw.ImageDraw, objects: Sequence[str], ending: str, *, is_good: bool
) -> None:
    """Write the objects in hand and how the episode ended; `ending` is empty until then."""
    y = _BELOW + 112.0
    names = ", ".join(objects)
    pen.text((_RIGHT, y + 16), "in hand", font=font(14), fill=FAINT, anchor="ls")
    text = fit_line(one_line(names) or "nothing", font(16), SIZE[0] - _EDGE - _RIGHT - 90)
    pen.text(
        (SIZE[0] - _EDGE, y + 16), text, font=font(16), fill=INK if names else FAINT, anchor="rs"
    )
    if not ending:
        return
    box = (_RIGHT, y + 34, SIZE[0] - _EDGE, y + 76)
    pen.rounded_rectangle(box, 8, fill=GOOD if is_good else BAD)
    face = font(18, "-Bold")
    words = fit_line(one_line(ending), face, box[2] - box[0] - 20)
    pen.text(((box[0] + box[2]) / 2, y + 55), words, font=face, fill="white", anchor="mm")
