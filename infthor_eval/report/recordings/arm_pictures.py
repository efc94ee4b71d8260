"""Replayed frames of an arm as pictures: the view beside the arm's reach, the request below."""

from collections.abc import Iterable, Iterator
from functools import partial

from PIL import Image

from infthor_eval.manipulation.recorded.replay_frames import ArmFrame
from infthor_eval.report.recordings.canvas import (
    BAD,
    FAINT,
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
from infthor_eval.report.recordings.fonts import one_line
from infthor_eval.report.recordings.reach_view import draw_reach


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
    """Draw a frame.

    Raises:
        ValueError: it has no observation.
    """
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
