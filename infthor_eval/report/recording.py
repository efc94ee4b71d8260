"""Moments of an agent as pictures for people: frame and map beside each other, and beneath them what was done."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from PIL import Image, ImageDraw

from infthor_eval.agents.moments import Moment, PlanTitle, Rewards
from infthor_eval.report.lettering import fitted, font, lines_of, one_line
from infthor_eval.report.room_map import draw_map

__all__ = ["END_HELD", "SIZE", "TITLE_HELD", "draw_moment", "draw_title", "pictures"]

SIZE = (1248, 896)  # of a picture; multiples of 16, as codecs like it
TITLE_HELD, END_HELD = 3, 3  # pictures that a plan's title and its end are shown for
_PANE = 600  # width and height of frame and map
_EDGE, _TOP = 16, 40
_BELOW = _TOP + _PANE + 16  # where the words begin
_LABELS, _WORDS, _RIGHT = _EDGE, 150, 880  # columns
_INK, _FAINT, _PAPER = "#1c1c1c", "#6b6b6b", "#ffffff"
_GOOD, _BAD, _WARN, _BAR = "#1a7f37", "#c1272d", "#9a5b00", "#0072B2"


class _Line(NamedTuple):
    """A line of the words: what it is called, what it says, how."""

    label: str
    text: str
    size: int = 16
    style: str = ""
    colour: str = _INK
    most: int = 1


def pictures(moments: Iterable[Moment], heading: str) -> Iterator[Image.Image]:
    """All pictures of some moments: before each plan its title, and its end held.

    Args:
        moments: in time order.
        heading: above each picture: which run, which trajectory.
    """
    for moment in moments:
        if moment.number == 0:
            title = draw_title(moment, heading)
            yield from [title] * TITLE_HELD
        if moment.sight is not None:
            picture = draw_moment(moment, heading)
            yield from [picture] * (END_HELD if moment.ending else 1)


def draw_title(moment: Moment, heading: str) -> Image.Image:
    """The card before a plan; of one that was never begun it says why."""
    picture, pen = _page(heading)
    title, middle = moment.title, SIZE[0] / 2
    expert = f"the expert took {_counted(title.n_expert, 'action')}"
    most = moment.rewards.most_of_plan
    lines = [
        _Line("", _place(title), 26, colour=_FAINT),
        _Line("", one_line(title.text), 46, "-Bold", most=2),
        _Line("", f"goal: {one_line(title.goal)}", 24, most=3),
        _Line("", expert if most is None else f"{expert}; at most {_points(most)}", 20, colour=_FAINT),
        _Line("", one_line(moment.ending), 24, "-Bold", _BAD, most=3),
    ]
    y = 270.0
    for line in lines:
        face = font(line.size, line.style)
        for part in lines_of(line.text, face, SIZE[0] - 160, line.most):
            pen.text((middle, y), part, font=face, fill=line.colour, anchor="ma")
            y += line.size * 1.4
        y += 18
    return picture


def draw_moment(moment: Moment, heading: str) -> Image.Image:
    """A moment that there is something to be seen of.

    Raises:
        ValueError: there is not.
    """
    if moment.sight is None:
        raise ValueError("there is nothing to be seen of this moment")
    picture, pen = _page(heading)
    frame = Image.fromarray(moment.sight.frame).resize((_PANE, _PANE), Image.Resampling.BICUBIC)
    picture.paste(frame, (_EDGE, _TOP))
    picture.paste(draw_map(moment.sight, _PANE), (_EDGE + _PANE + _EDGE, _TOP))
    _write_lines(pen, _lines(moment))
    _write_rewards(pen, moment.rewards)
    _write_state(pen, moment)
    return picture


def _page(heading: str) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    picture = Image.new("RGB", SIZE, _PAPER)
    pen = ImageDraw.Draw(picture)
    face = font(15)
    text = fitted(one_line(heading), face, SIZE[0] - 2 * _EDGE)
    pen.text((_EDGE, _TOP / 2), text, font=face, fill=_FAINT, anchor="lm")
    return picture, pen


def _lines(moment: Moment) -> list[_Line]:
    title = moment.title
    lines = [
        _Line("goal", title.goal, 17, most=2),
        _Line(f"plan {title.number} of {title.n_plans}", title.text, 22, "-Bold"),
    ]
    if moment.number:
        action = _Line("", moment.action, 20, "Mono") if moment.action else _Line("", "none that could be tried", 18)
        lines.append(action._replace(label=f"action {moment.number} of {title.n_actions}"))
    else:
        lines.append(_Line("", "the plan begins", 18, colour=_FAINT))
    lines += [_Line("model said", moment.reply, 16, "Mono")] if moment.reply else []
    lines += [_Line("wrong", moment.wrong, 16, colour=_BAD, most=2)] if moment.wrong else []
    lines += [_Line("differs", moment.note, 15, colour=_WARN, most=2)] if moment.note else []
    return lines


def _write_lines(pen: ImageDraw.ImageDraw, lines: Iterable[_Line]) -> None:
    y = float(_BELOW)
    for line in lines:
        face = font(line.size, line.style)
        parts = lines_of(one_line(line.text), face, _RIGHT - _WORDS - 24, line.most)
        pen.text((_LABELS, y + line.size), line.label, font=font(14), fill=_FAINT, anchor="ls")
        for part in parts or [""]:
            pen.text((_WORDS, y + line.size), part, font=face, fill=line.colour, anchor="ls")
            y += line.size * 1.3
        y += 5


def _write_rewards(pen: ImageDraw.ImageDraw, rewards: Rewards) -> None:
    y = float(_BELOW)
    step = "-" if rewards.step is None else f"{rewards.step:+.1f}"
    plan = _share(rewards.plan, rewards.most_of_plan)
    for label, text in (("this action", step), ("this plan", plan), ("so far", _share(rewards.so_far, rewards.most))):
        pen.text((_RIGHT, y + 18), label, font=font(14), fill=_FAINT, anchor="ls")
        pen.text((SIZE[0] - _EDGE, y + 18), text, font=font(18, "-Bold"), fill=_INK, anchor="rs")
        y += 29
    left, right = _RIGHT, SIZE[0] - _EDGE
    pen.rectangle((left, y, right, y + 10), fill="#e3e6ea")
    share = min(max(rewards.so_far / rewards.most, 0.0), 1.0) if rewards.most > 0 else 0.0
    if share:
        pen.rectangle((left, y, left + share * (right - left), y + 10), fill=_BAR)


def _write_state(pen: ImageDraw.ImageDraw, moment: Moment) -> None:
    """What is held, and how the plan ended."""
    y = _BELOW + 112.0
    held = ", ".join(moment.sight.held) if moment.sight is not None else ""
    pen.text((_RIGHT, y + 16), "in hand", font=font(14), fill=_FAINT, anchor="ls")
    text = fitted(one_line(held) or "nothing", font(16), SIZE[0] - _EDGE - _RIGHT - 90)
    pen.text((SIZE[0] - _EDGE, y + 16), text, font=font(16), fill=_INK if held else _FAINT, anchor="rs")
    if not moment.ending:
        return
    box = (_RIGHT, y + 34, SIZE[0] - _EDGE, y + 76)
    pen.rounded_rectangle(box, 8, fill=_GOOD if moment.done else _BAD)
    words = one_line(moment.ending) + (", and the goal is reached" if moment.goal_reached else "")
    face = font(18, "-Bold")
    pen.text(
        ((box[0] + box[2]) / 2, y + 55), fitted(words, face, box[2] - box[0] - 20), font=face, fill="white", anchor="mm"
    )


def _place(title: PlanTitle) -> str:
    return f"plan {title.number} of {title.n_plans}"


def _share(value: float, most: float | None) -> str:
    return f"{value:.1f}" if most is None else f"{value:.1f} of {most:.1f}"


def _points(value: float) -> str:
    return f"{value:.1f} points"


def _counted(count: int, what: str) -> str:
    return f"1 {what}" if count == 1 else f"{count} {what}s"
