"""Episodes of an arm on one page: a row for each, with frames from its start to its end."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from PIL import Image, ImageDraw

from infthor_eval.manipulation.replay_frames import ArmFrame
from infthor_eval.report.recordings.canvas import BAD, FAINT, GOOD, INK, WARN
from infthor_eval.report.recordings.fonts import fitted, font, lines_of, one_line

__all__ = ["COLUMNS", "MOST_ROWS", "draw_sheet", "sheet_rows", "shown_steps"]

COLUMNS, MOST_ROWS = 5, 8  # more cannot be taken in at a glance
_CELL, _CAPTION, _GAP = 260, 56, 12  # pixels; a caption has three lines
_SIDE, _EDGE, _TOP = 230, 16, 44
_WIDTH = 2 * _EDGE + _SIDE + COLUMNS * (_CELL + _GAP) - _GAP


def shown_steps(n_steps: int) -> list[int]:
    """Which moments of an episode have a place: its start (0), its last step, and some between, evenly."""
    last = COLUMNS - 1
    return sorted({round(number * n_steps / last) for number in range(COLUMNS)})


def draw_sheet(episodes: Sequence[Sequence[ArmFrame]], heading: str) -> Image.Image:
    """The page.

    Args:
        episodes: moments of each that are shown (`shown_steps`), at most `COLUMNS`, in time order.
        heading: above them: which run, which trajectory.
    """
    row = _CELL + _CAPTION + _GAP
    picture = Image.new("RGB", (_WIDTH, _TOP + len(episodes) * row), "white")
    pen = ImageDraw.Draw(picture)
    face = font(16)
    pen.text((_EDGE, _TOP / 2), fitted(one_line(heading), face, _WIDTH - 2 * _EDGE), font=face, fill=FAINT, anchor="lm")
    for number, moments in enumerate(episodes):
        top = _TOP + number * row
        if number:
            pen.line((_EDGE, top - _GAP / 2, _WIDTH - _EDGE, top - _GAP / 2), fill="#dddddd")
        _write_side(pen, moments[-1], top)
        for column, moment in enumerate(moments):
            _draw_cell(picture, moment, _EDGE + _SIDE + column * (_CELL + _GAP), top)
    return picture


def sheet_rows(moments: Iterable[ArmFrame]) -> Iterator[list[ArmFrame]]:
    """Yield the moments of each episode that have a place; a difference between two places goes to the later one."""
    row: list[ArmFrame] = []
    note = ""
    for moment in moments:
        note = moment.note or note
        if moment.number in shown_steps(moment.title.n_steps):
            row.append(replace(moment, note=note))
            note = ""
        if moment.ending:
            yield row
            row, note = [], ""


def _write_side(pen: ImageDraw.ImageDraw, end: ArmFrame, top: float) -> None:
    """What the episode asks for, and how it ended."""
    title = end.title
    _write(pen, (_EDGE, top), [f"{title.kind}, action {title.action}"], 14, "", FAINT)
    y = _write(pen, (_EDGE, top + 24), [title.instruction], 18, "-Bold", INK, most=4)
    facts = [f"radius {title.radius:g} m"]
    if end.observation is not None:
        facts += [f"steps: {title.n_steps}", f"collisions: {end.n_collisions}"]
        facts += [f"closest: {end.closest:.2f} m"] if end.closest is not None else []
    y = _write(pen, (_EDGE, y + 8), facts, 14, "", INK)
    _write(pen, (_EDGE, y + 8), [end.ending], 17, "-Bold", GOOD if end.done else BAD, most=4)


def _draw_cell(picture: Image.Image, moment: ArmFrame, left: int, top: int) -> None:
    if moment.observation is None:
        return
    frame = Image.fromarray(moment.observation.frame).resize((_CELL, _CELL), Image.Resampling.BICUBIC)
    picture.paste(frame, (left, top))
    when = "start" if not moment.number else f"step {moment.number}"
    where = "" if moment.distance is None else f", {moment.distance:.2f} m off"
    colour = WARN if moment.note else INK
    pen = ImageDraw.Draw(picture)
    _write(pen, (left, top + _CELL + 3), [when + where], 14, "-Bold", colour, width=_CELL)
    told = moment.note or "; ".join(moment.refusals) or ", ".join(moment.actions)
    colour = WARN if moment.note else BAD if moment.refusals else FAINT
    _write(pen, (left, top + _CELL + 20), [told], 12, "", colour, most=2, width=_CELL)


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
    """Lines one below the other; gives where the next one would stand."""
    face = font(size, style)
    x, y = at
    for text in texts:
        for line in lines_of(one_line(text), face, width, most):
            pen.text((x, y), line, font=face, fill=colour, anchor="la")
            y += size * 1.3
    return y
