"""Where a question waits for its answer."""

import threading

import pytest

from model_adapters import Decoding, Notice, Turn
from model_adapters.human.desk import Answer, Desk, Inquiry, ScreenClock, StaleError

from ...helpers.waiting import wait_until

ASKED = Inquiry((Turn("user", ("Where is the mug?",)),), Decoding(max_new_tokens=5), Notice())


def asking(desk):
    """Ask in a thread; the answer, or the type of the error, comes into a list."""
    answers = []

    def ask():
        try:
            answers.append(desk.ask(ASKED))
        except KeyboardInterrupt as error:
            answers.append(type(error))

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    wait_until(lambda: desk.question is not None)
    return thread, answers


def test_a_question_waits_for_its_answer_and_is_gone_then():
    desk = Desk()
    thread, answers = asking(desk)
    assert desk.question is not None and desk.question.number == 1
    desk.give(1, "Fridge", 7)
    thread.join()
    assert (answers, desk.question) == ([Answer("Fridge", 7, None)], None)


@pytest.mark.parametrize("is_kept", [True, False])
def test_an_answer_counts_once_the_run_has_kept_it(is_kept):
    desk = Desk()
    thread, _ = asking(desk)
    desk.give(1, "Fridge", 7)
    thread.join()
    kept = []
    telling = threading.Thread(target=lambda: kept.append(desk.wait_until_kept(1)), daemon=True)
    telling.start()
    telling.join(0.05)
    assert (kept, desk.n_answered) == ([], 0)
    if is_kept:
        thread, _ = asking(desk)  # the run goes on when the record is on disk
        telling.join(60.0)
        desk.stop()
        thread.join()
    else:
        desk.close(is_kept=False)
        telling.join(60.0)
    assert (kept, desk.n_answered) == ([is_kept], int(is_kept))


def test_an_answer_to_another_question_is_refused_and_the_first_of_two_counts():
    desk = Desk()
    with pytest.raises(StaleError):
        desk.give(1, "too early", 0)
    thread, answers = asking(desk)
    with pytest.raises(StaleError):
        desk.give(2, "another", 0)
    desk.give(1, "first", 0)
    with pytest.raises(StaleError):
        desk.give(1, "second", 0)
    thread.join()
    assert answers == [Answer("first", 0, None)]
    thread, _ = asking(desk)
    assert desk.question is not None and desk.question.number == 2
    desk.stop()
    thread.join()


def test_a_run_that_is_stopped_ends_as_by_ctrl_c():
    desk = Desk()
    thread, answers = asking(desk)
    desk.stop()
    thread.join()
    assert (answers, desk.n_answered) == ([KeyboardInterrupt], 0)


def test_who_waits_for_a_change_learns_of_it():
    desk = Desk()
    seen = desk.version
    with desk.reading():
        desk.close()
    assert desk.is_closed and desk.version > seen


def test_it_ends_at_once_where_nobody_has_asked():
    desk = Desk()
    desk.close()
    desk.wait_until_informed(60.0, 60.0)


@pytest.mark.parametrize(
    ("is_waiting", "patience"),
    [(False, (0.0, 60.0)), (True, (60.0, 0.0))],  # of a page that waits for news, longer
)
def test_it_ends_when_a_page_has_learned_of_it(is_waiting, patience):
    desk = Desk()
    if is_waiting:
        with desk.reading():
            desk.close()
    else:
        desk.close()
        with desk.reading():
            pass
    ending = threading.Thread(target=desk.wait_until_informed, args=patience, daemon=True)
    ending.start()
    ending.join(0.05)
    assert ending.is_alive()
    desk.report_closed()
    ending.join(60.0)
    assert not ending.is_alive()


def test_the_clock_goes_while_a_page_shows_the_question(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("model_adapters.human.desk.time.monotonic", lambda: now[0])
    clock = ScreenClock()
    now[0] += 30.0  # the frames are on their way
    assert clock.seconds is None
    clock.show("a")
    now[0] += 2.0
    clock.show("a")  # told twice
    clock.show("b")
    now[0] += 3.0
    clock.hide("a")
    now[0] += 4.0
    clock.hide("b")
    now[0] += 1000.0  # a break
    assert clock.seconds == 9.0
    clock.hide("b")
    clock.show("c")  # taken up again
    now[0] += 1.0
    assert clock.seconds == 10.0


def test_what_a_page_tells_of_another_question_is_not_counted():
    desk = Desk()
    thread, answers = asking(desk)
    desk.report_screen(2, "a", shows=True)
    assert desk.question is not None and desk.question.clock.seconds is None
    desk.report_screen(1, "a", shows=True)
    desk.give(1, "Fridge", 0)
    desk.report_screen(1, "a", shows=False)
    thread.join()
    assert [answer.seconds is not None for answer in answers if isinstance(answer, Answer)] == [
        True
    ]
