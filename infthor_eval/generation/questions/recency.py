"""What was put down or opened last, second to last and so on: forms of ours for pairs of moments.

Their answers change with each such event, and need not grow.
"""

from collections.abc import Iterator, Sequence

from infthor_eval.generation.questions.candidates import Candidate, further_type, type_question
from infthor_eval.generation.questions.history import TrajectoryHistory

QUESTION_TYPE = further_type("recency")
ORDINALS = ("last", "second to last", "third to last", "fourth to last", "fifth to last")


def recent(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the questions whose clues show all events from the one asked about to the moment.

    The first two clues are of the event asked about.
    """
    puts = [
        (move.object_type, history.target_type(move), history.put_clues(move))
        for move in history.moves
    ]
    opened = [
        (event.object_type, history.opening_clues(event))
        for event in history.events
        if event.action == "OpenObject"
    ]
    things = [(name, clues) for name, _, clues in puts]
    places = [(place, clues) for _, place, clues in puts]
    yield from _backwards("What did you put down {}?", things)
    yield from _backwards("Where did you put the object that you put down {}?", places)
    yield from _backwards("What did you open {}?", opened)


def _backwards(
    form: str, events: Sequence[tuple[str, tuple[int, int] | None]]
) -> Iterator[Candidate]:
    """Yield a form about the last events, as far back as frames show each of them."""
    clues: tuple[int, ...] = ()
    for ordinal, (name, shown) in zip(ORDINALS, reversed(events), strict=False):
        if shown is None:
            return
        clues = (*shown, *clues)
        yield from type_question(QUESTION_TYPE, form, (ordinal,), clues, [name])
