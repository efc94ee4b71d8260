"""Episodes of an arm on one page: a row for each, with frames from its start to its end."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from PIL import Image, ImageDraw

from infthor_eval.manipulation.recorded.replay_frames import ArmFrame
from infthor_eval.report.recordings.canvas import BAD, FAINT, GOOD, INK, WARN
from infthor_eval.report.recordings.fonts import break_lines, fit_line, font, one_line
from infthor_eval.report.runs import choose_evenly

# more would not fit on a screen
COLUMNS = 5
MOST_ROWS = 8
# pixels; a caption has three lines
_CELL = 260
_CAPTION = 56
_GAP = 12
_SIDE = 230
_EDGE = 16
_TOP = 44
_WIDTH = 2 * _EDGE + _SIDE + COLUMNS * (_CELL + _GAP) - _GAP


def shown_steps(n_steps: int) -> list[int]:
    """Return an episode's shown steps: its start (0), its last, and some between, evenly spaced."""
    return choose_evenly(range(n_steps + 1), COLUMNS)


def draw_sheet(episodes: Sequence[Sequence[ArmFrame]], heading: str) -> Image.Image:
    """Draw the sheet, with the run and the trajectory as its heading.

    Args:
        episodes: the frames of each episode that are shown (`shown_steps`), at most `COLUMNS`, in
            time order.
    """
    row = _CELL + _CAPTION + _GAP
    picture = Image.new("RGB", (_WIDTH, _TOP + len(episodes) * row), "white")
    pen = ImageDraw.Draw(picture)
    face = font(16)
    text = fit_line(one_line(heading), face, _WIDTH - 2 * _EDGE)
    pen.text((_EDGE, _TOP / 2), text, font=face, fill=FAINT, anchor="lm")
    for number, frames in enumerate(episodes):
        top = _TOP + number * row
        if number:
            pen.line((_EDGE, top - _GAP / 2, _WIDTH - _EDGE, top - _GAP / 2), fill="#dddddd")
        _write_side(pen, frames[-1], top)
        for column, frame in enumerate(frames):
            _draw_cell(picture, frame, _EDGE + _SIDE + column * (_CELL + _GAP), top)
    return picture


def sheet_rows(frames: Iterable[ArmFrame]) -> Iterator[list[ArmFrame]]:
    """Yield each episode's shown frames; a difference of two is noted at the later one."""
    row: list[ArmFrame] = []
    note = ""
    for frame in frames:
        note = frame.note or note
        if frame.number in shown_steps(frame.title.n_steps):
            row.append(replace(frame, note=note))
            note = ""
        if frame.ending:
            yield row
            row = []
            note = ""


def _write_side(pen: ImageDraw.ImageDraw, end: ArmFrame, top: float) -> None:
    """Write the instruction of an episode, and how it ended."""
    title = end.title
    _write(pen, (_EDGE, top), [f"{title.kind}, action {title.action}"], 14, "", FAINT)
    y = _write(pen, (_EDGE, top + 24), [title.instruction], 18, "-Bold", INK, most=4)
    facts = [f"radius {title.radius:g} m"]
    if end.observation is not None:
        facts += [f"steps: {title.n_steps}", f"collisions: {end.n_collisions}"]
        facts += [f"closest: {end.closest:.2f} m"] if end.closest is not None else []
    y = _write(pen, (_EDGE, y + 8), facts, 14, "", INK)
    _write(pen, (_EDGE, y + 8), [end.ending], 17, "-Bold", GOOD if end.done else BAD, most=4)


def _draw_cell(picture: Image.Image, frame: ArmFrame, left: int, top: int) -> None:
    if frame.observation is None:
        return
    view = Image.fromarray(frame.observation.frame).resize((_CELL, _CELL), Image.Resampling.BICUBIC)
    picture.paste(view, (left, top))
    when = "start" if not frame.number else f"step {frame.number}"
    where = "" if frame.distance is None else f", {frame.distance:.2f} m off"
    colour = WARN if frame.note else INK
    pen = ImageDraw.Draw(picture)
    _write(pen, (left, top + _CELL + 3), [when + where], 14, "-Bold", colour, width=_CELL)
    text = frame.note or "; ".join(frame.refusals) or ", ".join(frame.actions)
    colour = WARN if frame.note else BAD if frame.refusals else FAINT
    _write(pen, (left, top + _CELL + 20), [text], 12, "", colour, most=2, width=_CELL)


def _write(
    pen: ImageDraw.ImageDraw,
    at: tuple[float, float],
    texts: Iterable[str],
    size: int,
    style: str,
    colour: str,
    *,
    most: int = 1,
    width: float = _SIDE - 16,
) -> float:
    """Write lines one below the other, and return the top of the next one."""
    face = font(size, style)
    x, y = at
    for text in texts:
        for line in break_lines(one_line(text), face, width, most):
            pen.text((x, y), line, font=face, fill=colour, anchor="la")
            y += size * 1.3
    return y
