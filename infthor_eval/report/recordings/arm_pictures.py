"""Moments of an arm as pictures for people: frame and reach beside each other, and beneath them what was asked."""

from collections.abc import Iterable, Iterator

from PIL import Image

from infthor_eval.manipulation.replay_frames import ArmFrame
from infthor_eval.report.recordings.canvas import (
    BAD,
    FAINT,
    PANE,
    TITLE_HELD,
    WARN,
    Line,
    card,
    held,
    page,
    write_in_hand,
    write_lines,
    write_numbers,
)
from infthor_eval.report.recordings.fonts import one_line
from infthor_eval.report.recordings.reach_view import draw_reach

__all__ = ["arm_pictures", "draw_arm_moment", "draw_arm_title"]


def arm_pictures(moments: Iterable[ArmFrame], heading: str) -> Iterator[Image.Image]:
    """All pictures of some moments: before each episode its title, and its end held.

    Args:
        moments: in time order.
        heading: above each picture: which run, which trajectory.
    """
    for moment in moments:
        if moment.number == 0:
            yield from [draw_arm_title(moment, heading)] * TITLE_HELD
        if moment.observation is not None:
            yield from held(draw_arm_moment(moment, heading), is_end=bool(moment.ending))


def draw_arm_title(moment: ArmFrame, heading: str) -> Image.Image:
    """The card before an episode; of one in which nobody acted it says why."""
    title = moment.title
    place = f"{title.kind}, episode {title.number} of {title.n_episodes} (the expert's action {title.action})"
    told = f"radius of the hand's sphere {title.radius:g} m; a success earns {moment.max_reward:g} points"
    lines = [
        Line("", place, 26, colour=FAINT),
        Line("", one_line(title.instruction), 46, "-Bold", most=2),
        Line("", told, 20, colour=FAINT),
        Line("", one_line(moment.ending) if moment.observation is None else "", 24, "-Bold", BAD, most=3),
    ]
    return card(heading, lines)


def draw_arm_moment(moment: ArmFrame, heading: str) -> Image.Image:
    """A moment that there is something to be seen of.

    Raises:
        ValueError: there is not.
    """
    if moment.observation is None:
        raise ValueError("there is nothing to be seen of this moment")
    picture, pen = page(heading, Image.fromarray(moment.observation.frame), draw_reach(moment.observation.reach, PANE))
    write_lines(pen, _lines(moment))
    numbers = [
        ("distance to the target", _metres(moment.distance)),
        ("closest so far", _metres(moment.closest)),
        ("collisions so far", str(moment.n_collisions)),
    ]
    write_numbers(pen, numbers)
    reward = f": {moment.reward:g} of {moment.max_reward:g} points" if moment.ending else ""
    write_in_hand(pen, moment.observation.held, moment.ending + reward, is_good=moment.done)
    return picture


def _lines(moment: ArmFrame) -> list[Line]:
    title = moment.title
    lines = [Line(f"{title.kind} {title.number} of {title.n_episodes}", title.instruction, 22, "-Bold")]
    label = f"step {moment.number} of {title.n_steps}"
    if moment.number:
        lines += [Line(label if not n else "", text, 16, "Mono", most=2) for n, text in enumerate(moment.requests)]
    else:
        lines.append(Line("", "the episode begins", 18, colour=FAINT))
    lines += [Line("refused", "; ".join(moment.refusals), 16, colour=BAD, most=2)] if moment.refusals else []
    lines += [Line("differs", moment.note, 15, colour=WARN, most=2)] if moment.note else []
    return lines


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f} m"
