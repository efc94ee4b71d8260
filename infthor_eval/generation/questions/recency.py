"""What was put down or opened last, second to last and so on: forms of ours for pairs of moments.

Their answers change with each such event, and need not grow.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.formats.outline import Outline
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.generation.questions.candidates import Candidate, further_type, type_question
from infthor_eval.generation.questions.history import TrajectoryHistory

QUESTION_TYPE = further_type("recency")
ORDINALS = ("last", "second to last", "third to last", "fourth to last", "fifth to last")


@dataclass(frozen=True)
class Occurrence:
    """An object was put down or opened.

    Attributes:
        frame: frame after it.
        object_type: type of the object.
        place: type of what it was put into or onto; None for an opening.
        is_shown: True if that frame and the one before show it.
    """

    frame: int
    object_type: str
    place: str | None
    is_shown: bool


def occurrences(history: TrajectoryHistory) -> list[Occurrence]:
    """Return what was put down and opened, in the order of time."""
    puts = (
        Occurrence(
            move.after,
            move.object_type,
            history.target_type(move),
            history.put_clues(move) is not None,
        )
        for move in history.moves
    )
    opened = (
        Occurrence(event.frame, event.object_type, None, history.opening_clues(event) is not None)
        for event in history.events
        if event.action == "OpenObject"
    )
    return sorted((*puts, *opened), key=lambda event: event.frame)


def logged_occurrences(
    outline: Outline, frames: Mapping[int, Sequence[int]], logs: Sequence[ObjectLog]
) -> Iterator[Occurrence]:
    """Yield what was put down and opened, by a published log, which names types alone.

    Two frames show a put if the object is in the hand in the first, and where it was put is in view
    in the second; an opening, if it is in view in the first, and open in the second.

    Args:
        outline: the trajectory.
        frames: positions of the frames of each low-level action that has any.
        logs: the published fields of each frame.
    """
    at = 1
    for number, (action, types) in enumerate(outline.interactions):
        at = max(at, *frames.get(number, ()))
        before = logs[at - 1]
        after = logs[at]
        match action, types:
            case "PutObject", [name, place]:
                is_shown = name in before.inven_obj and place in after.visible
                yield Occurrence(at, name, place, is_shown and number in frames)
            case "OpenObject", [name]:
                is_shown = name in before.visible and name in after.is_open
                yield Occurrence(at, name, None, is_shown and number in frames)


def recent(events: Iterable[Occurrence]) -> Iterator[Candidate]:
    """Yield the questions whose clues show all events from the one asked about to the moment.

    Args:
        events: what has happened by then, in the order of time.
    """
    happened = list(events)
    opened = [event for event in happened if event.place is None]
    puts = [event for event in happened if event.place is not None]
    yield from _backwards("What did you put down {}?", puts, [it.object_type for it in puts])
    where = "Where did you put the object that you put down {}?"
    yield from _backwards(where, puts, [it.place or "" for it in puts])
    yield from _backwards("What did you open {}?", opened, [it.object_type for it in opened])


def _backwards(
    form: str, events: Sequence[Occurrence], answers: Sequence[str]
) -> Iterator[Candidate]:
    """Yield a form about the last events, as far back as frames show each of them."""
    clues: tuple[int, ...] = ()
    for ordinal, event, answer in zip(ORDINALS, reversed(events), reversed(answers), strict=False):
        if not event.is_shown:
            return
        clues = (event.frame - 1, event.frame, *clues)
        yield from type_question(QUESTION_TYPE, form, (ordinal,), clues, [answer])
