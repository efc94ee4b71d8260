"""Moments of an agent as pictures for people: frame and map beside each other, and beneath them what was done."""

from collections.abc import Iterable, Iterator

from PIL import Image

from infthor_eval.plans.replay_frames import PlanFrame, PlanTitle
from infthor_eval.report.recordings.canvas import (
    BAD,
    END_HELD,
    FAINT,
    PANE,
    SIZE,
    TITLE_HELD,
    WARN,
    Line,
    card,
    held,
    page,
    write_bar,
    write_in_hand,
    write_lines,
    write_numbers,
)
from infthor_eval.report.recordings.fonts import one_line
from infthor_eval.report.recordings.room_map import draw_map

__all__ = ["END_HELD", "SIZE", "TITLE_HELD", "draw_moment", "draw_title", "pictures"]


def pictures(moments: Iterable[PlanFrame], heading: str) -> Iterator[Image.Image]:
    """All pictures of some moments: before each plan its title, and its end held.

    Args:
        moments: in time order.
        heading: above each picture: which run, which trajectory.
    """
    for moment in moments:
        if moment.number == 0:
            title = draw_title(moment, heading)
            yield from [title] * TITLE_HELD
        if moment.observation is not None:
            yield from held(draw_moment(moment, heading), is_end=bool(moment.ending))


def draw_title(moment: PlanFrame, heading: str) -> Image.Image:
    """The card before a plan; of one that was never begun it says why."""
    title = moment.title
    expert = f"the expert took {_counted(title.n_expert, 'action')}"
    most = moment.rewards.max_of_plan
    lines = [
        Line("", _place(title), 26, colour=FAINT),
        Line("", one_line(title.text), 46, "-Bold", most=2),
        Line("", f"goal: {one_line(title.goal)}", 24, most=3),
        Line("", expert if most is None else f"{expert}; at most {_points(most)}", 20, colour=FAINT),
        Line("", one_line(moment.ending), 24, "-Bold", BAD, most=3),
    ]
    return card(heading, lines)


def draw_moment(moment: PlanFrame, heading: str) -> Image.Image:
    """A moment that there is something to be seen of.

    Raises:
        ValueError: there is not.
    """
    if moment.observation is None:
        raise ValueError("there is nothing to be seen of this moment")
    picture, pen = page(heading, Image.fromarray(moment.observation.frame), draw_map(moment.observation, PANE))
    write_lines(pen, _lines(moment))
    rewards = moment.rewards
    step = "-" if rewards.step is None else f"{rewards.step:+.1f}"
    plan = _share(rewards.plan, rewards.max_of_plan)
    write_numbers(
        pen, [("this action", step), ("this plan", plan), ("so far", _share(rewards.so_far, rewards.max_so_far))]
    )
    write_bar(pen, min(max(rewards.so_far / rewards.max_so_far, 0.0), 1.0) if rewards.max_so_far > 0 else 0.0)
    ending = one_line(moment.ending) + (", and the goal is reached" if moment.goal_reached else "")
    write_in_hand(pen, moment.observation.held, ending if moment.ending else "", is_good=moment.done)
    return picture


def _lines(moment: PlanFrame) -> list[Line]:
    title = moment.title
    lines = [
        Line("goal", title.goal, 17, most=2),
        Line(f"plan {title.number} of {title.n_plans}", title.text, 22, "-Bold"),
    ]
    if moment.number:
        action = Line("", moment.action, 20, "Mono") if moment.action else Line("", "none that could be tried", 18)
        lines.append(action._replace(label=f"action {moment.number} of {title.n_actions}"))
    else:
        lines.append(Line("", "the plan begins", 18, colour=FAINT))
    lines += [Line("model said", moment.reply, 16, "Mono")] if moment.reply else []
    lines += [Line("wrong", moment.wrong, 16, colour=BAD, most=2)] if moment.wrong else []
    lines += [Line("differs", moment.note, 15, colour=WARN, most=2)] if moment.note else []
    return lines


def _place(title: PlanTitle) -> str:
    return f"plan {title.number} of {title.n_plans}"


def _share(value: float, most: float | None) -> str:
    return f"{value:.1f}" if most is None else f"{value:.1f} of {most:.1f}"


def _points(value: float) -> str:
    return f"{value:.1f} points"


def _counted(count: int, what: str) -> str:
    return f"1 {what}" if count == 1 else f"{count} {what}s"
