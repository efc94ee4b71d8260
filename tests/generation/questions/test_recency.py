"""What was put down or opened last, second to last and so on, and that the solver agrees."""

import pytest

from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.history import DEFAULT_SHARE
from infthor_eval.generation.questions.recency import ORDINALS, occurrences, recent

from .logs import history, moved, state

MUG, BOOK, DESK, SHELF = "Mug|1|0|0", "Book|2|0|0", "Desk|3|0|0", "Shelf|4|0|0"
FRIDGE, SAFE = "Fridge|5|0|0", "Safe|6|0|0"
START = {
    MUG: state(MUG, DESK),
    BOOK: state(BOOK, SHELF),
    DESK: state(DESK),
    SHELF: state(SHELF),
    FRIDGE: state(FRIDGE, is_open=False),
    SAFE: state(SAFE, is_open=False),
}


def opened(key):
    """Two events: a container is opened, and closed."""
    return (
        ("OpenObject", key, None, {key: state(key, is_open=True)}),
        ("CloseObject", key, None, {key: state(key, is_open=False)}),
    )


def made():
    """A mug is put on the shelf, the fridge opened, a book put on the desk, the safe opened."""
    return history(
        START, *moved(MUG, DESK, SHELF), *opened(FRIDGE), *moved(BOOK, SHELF, DESK), *opened(SAFE)
    )


def answers(log):
    return {it.text: (it.answers, it.clues) for it in recent(occurrences(log))}


def test_events_count_back_from_the_moment():
    log = made()
    assert answers(log) == {
        "What did you put down last?": (("book",), (5, 6)),
        "What did you put down second to last?": (("mug",), (1, 2, 5, 6)),
        "Where did you put the object that you put down last?": (("desk",), (5, 6)),
        "Where did you put the object that you put down second to last?": (
            ("shelf",), (1, 2, 5, 6),
        ),
        "What did you open last?": (("safe",), (6, 7)),
        "What did you open second to last?": (("fridge",), (2, 3, 6, 7)),
    }  # fmt: skip
    assert answers(log.until(4)) == {
        "What did you put down last?": (("mug",), (1, 2)),
        "Where did you put the object that you put down last?": (("shelf",), (1, 2)),
        "What did you open last?": (("fridge",), (2, 3)),
    }
    assert not answers(log.until(1))


def test_no_question_counts_past_an_event_that_no_frame_shows():
    hidden = made()
    for step in hidden.steps[5:7]:
        step.seen[BOOK] = ObjectInFrame(1, (10, 10, 10, 10), True)
    found = answers(hidden)
    assert set(found) == {"What did you open last?", "What did you open second to last?"}


@pytest.mark.parametrize("moment", [2, 4, 6, 8])
def test_the_solver_says_the_same_from_the_log_and_from_the_clues(moment):
    log = made()
    checker = Checker(log.steps, DEFAULT_SHARE).until(moment)
    found = answers(log.until(moment))
    assert found
    for text, (gold, clues) in found.items():
        assert checker.answers(text) == checker.answers(text, clues) == gold
    for ordinal in ORDINALS[2:]:
        assert checker.answers(f"What did you open {ordinal}?") is None


def test_the_same_thing_put_down_twice_counts_twice():
    log = history(START, *moved(MUG, DESK, SHELF), *moved(MUG, SHELF, DESK))
    found = answers(log)
    assert found["What did you put down second to last?"][0] == ("mug",)
    assert found["Where did you put the object that you put down second to last?"][0] == ("shelf",)
    assert found["Where did you put the object that you put down last?"][0] == ("desk",)
