"""Replayed frames of an arm as pictures: the view beside the arm's reach, the request below; and
episodes on one page, a row for each, with frames from its start to its end."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from PIL import Image, ImageDraw

from infthor_eval.manipulation.recorded.replay_frames import ArmFrame
from infthor_eval.report.recordings.canvas import (
    BAD,
    FAINT,
    GOOD,
    INK,
    PANE,
    WARN,
    Line,
    draw_panes,
    film_pictures,
    title_card,
    write_in_hand,
    write_lines,
    write_numbers,
)
from infthor_eval.report.recordings.fonts import break_lines, fit_line, font, one_line
from infthor_eval.report.recordings.reach_view import draw_reach
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


def arm_pictures(frames: Iterable[ArmFrame], heading: str) -> Iterator[Image.Image]:
    """Draw frames with a heading, the run and the trajectory; see `film_pictures`."""
    return film_pictures(
        frames, partial(draw_arm_title, heading=heading), partial(draw_arm_frame, heading=heading)
    )


def draw_arm_title(frame: ArmFrame, heading: str) -> Image.Image:
    """Draw the card before an episode; for an episode without actions it has the reason."""
    title = frame.title
    position = (
        f"{title.kind}, episode {title.number} of {title.n_episodes} (the expert's action "
        f"{title.action})"
    )
    settings = (
        f"radius of the hand's sphere {title.radius:g} m; a success earns {frame.max_reward:g} "
        "points"
    )
    lines = [
        Line("", position, 26, colour=FAINT),
        Line("", one_line(title.instruction), 46, "-Bold", most=2),
        Line("", settings, 20, colour=FAINT),
        Line(
            "",
            one_line(frame.ending) if frame.observation is None else "",
            24,
            "-Bold",
            BAD,
            most=3,
        ),
    ]
    return title_card(heading, lines)


def draw_arm_frame(frame: ArmFrame, heading: str) -> Image.Image:
    """Draw a frame."""
    seen = frame.observation
    if seen is None:
        raise ValueError("the frame has no observation")
    picture, pen = draw_panes(heading, Image.fromarray(seen.frame), draw_reach(seen.reach, PANE))
    write_lines(pen, _lines(frame))
    numbers = [
        ("distance to the target", _metres(frame.distance)),
        ("closest so far", _metres(frame.closest)),
        ("collisions so far", str(frame.n_collisions)),
    ]
    write_numbers(pen, numbers)
    reward = f": {frame.reward:g} of {frame.max_reward:g} points" if frame.ending else ""
    write_in_hand(pen, seen.held, frame.ending + reward, is_good=frame.done)
    return picture


def _lines(frame: ArmFrame) -> list[Line]:
    title = frame.title
    lines = [
        Line(f"{title.kind} {title.number} of {title.n_episodes}", title.instruction, 22, "-Bold")
    ]
    label = f"step {frame.number} of {title.n_steps}"
    if frame.number:
        lines += [
            Line(label if not n else "", text, 16, "Mono", most=2)
            for n, text in enumerate(frame.requests)
        ]
    else:
        lines.append(Line("", "the episode begins", 18, colour=FAINT))
    lines += (
        [Line("refused", "; ".join(frame.refusals), 16, colour=BAD, most=2)]
        if frame.refusals
        else []
    )
    lines += [Line("differs", frame.note, 15, colour=WARN, most=2)] if frame.note else []
    return lines


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f} m"


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
