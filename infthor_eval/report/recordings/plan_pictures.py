"""Frames of replayed plans as pictures: the agent's view beside a map, and the action below."""

from collections.abc import Iterable, Iterator
from functools import partial

from PIL import Image

from infthor_eval.plans.recorded.replay_frames import PlanFrame, PlanTitle
from infthor_eval.report.recordings.canvas import (
    BAD,
    FAINT,
    PANE,
    WARN,
    Line,
    draw_panes,
    film_pictures,
    title_card,
    write_bar,
    write_in_hand,
    write_lines,
    write_numbers,
)
from infthor_eval.report.recordings.fonts import one_line
from infthor_eval.report.recordings.room_map import draw_map


def plan_pictures(frames: Iterable[PlanFrame], heading: str) -> Iterator[Image.Image]:
    """Draw frames with a heading, the run and the trajectory; see `film_pictures`."""
    return film_pictures(
        frames, partial(draw_plan_title, heading=heading), partial(draw_plan_frame, heading=heading)
    )


def draw_plan_title(frame: PlanFrame, heading: str) -> Image.Image:
    """Draw the card before a plan; for a plan that was never started it has the reason."""
    title = frame.title
    expert = f"the expert took {title.n_expert} {'action' if title.n_expert == 1 else 'actions'}"
    most = frame.rewards.max_of_plan
    lines = [
        Line("", _place(title), 26, colour=FAINT),
        Line("", one_line(title.text), 46, "-Bold", most=2),
        Line("", f"goal: {one_line(title.goal)}", 24, most=3),
        Line(
            "", expert if most is None else f"{expert}; at most {most:.1f} points", 20, colour=FAINT
        ),
        Line("", one_line(frame.ending), 24, "-Bold", BAD, most=3),
    ]
    return title_card(heading, lines)


def draw_plan_frame(frame: PlanFrame, heading: str) -> Image.Image:
    """Draw a frame.

    Raises:
        ValueError: it has no observation.
    """
    if frame.observation is None:
        raise ValueError("the frame has no observation")
    picture, pen = draw_panes(
        heading, Image.fromarray(frame.observation.frame), draw_map(frame.observation, PANE)
    )
    write_lines(pen, _lines(frame))
    rewards = frame.rewards
    step = "-" if rewards.step is None else f"{rewards.step:+.1f}"
    plan = _share(rewards.plan, rewards.max_of_plan)
    so_far = _share(rewards.so_far, rewards.max_so_far)
    write_numbers(pen, [("this action", step), ("this plan", plan), ("so far", so_far)])
    write_bar(
        pen,
        min(max(rewards.so_far / rewards.max_so_far, 0.0), 1.0) if rewards.max_so_far > 0 else 0.0,
    )
    ending = one_line(frame.ending) + (", and the goal is reached" if frame.goal_reached else "")
    write_in_hand(pen, frame.observation.held, ending if frame.ending else "", is_good=frame.done)
    return picture


def _lines(frame: PlanFrame) -> list[Line]:
    title = frame.title
    lines = [Line("goal", title.goal, 17, most=2), Line(_place(title), title.text, 22, "-Bold")]
    if frame.number:
        action = (
            Line("", frame.action, 20, "Mono") if frame.action else Line("", "no valid action", 18)
        )
        lines.append(action._replace(label=f"action {frame.number} of {title.n_actions}"))
    else:
        lines.append(Line("", "the plan starts", 18, colour=FAINT))
    lines += [Line("model said", frame.reply, 16, "Mono")] if frame.reply else []
    lines += [Line("wrong", frame.wrong, 16, colour=BAD, most=2)] if frame.wrong else []
    lines += [Line("differs", frame.note, 15, colour=WARN, most=2)] if frame.note else []
    return lines


def _place(title: PlanTitle) -> str:
    return f"plan {title.number} of {title.n_plans}"


def _share(value: float, most: float | None) -> str:
    return f"{value:.1f}" if most is None else f"{value:.1f} of {most:.1f}"
