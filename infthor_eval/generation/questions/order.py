"""Which of two things was picked up first: a form of ours that twins alone are asked.

Of one trajectory the answer would follow from any list of what was done; of two worlds in which the
objects have each other's tasks, only what was seen tells it.
"""

from collections.abc import Iterator
from itertools import permutations

from infthor_eval.generation.questions.candidates import Candidate, further_type
from infthor_eval.generation.questions.history import Event, TrajectoryHistory
from infthor_eval.household.wording import canonical_type, with_the

QUESTION_TYPE = further_type("order")


def orders(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield questions on each two objects that were picked up once, each the only one so named."""
    picked = [event for event in history.events if event.action == "PickupObject"]
    names = [canonical_type(event.object_type) for event in picked]
    once = [
        event
        for event, name in zip(picked, names, strict=True)
        if names.count(name) == 1 and _is_shown(history, event)
    ]
    for first, second in permutations(once, 2):
        yield Candidate(
            QUESTION_TYPE,
            "Did you pick up {} before {}?",
            (with_the(first.object_type), with_the(second.object_type)),
            tuple(sorted((first.frame, second.frame))),
            ("yes" if first.frame < second.frame else "no",),
            (first.object_type, second.object_type),
        )


def _is_shown(history: TrajectoryHistory, event: Event) -> bool:
    """Return True if the frame after a pick-up shows the object in the hand, told apart."""
    shown = history.shows(event.frame, event.target)
    return shown and history.is_alone_in_frame(event.frame, event.target)
