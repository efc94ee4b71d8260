"""Which questions pair, on logs made by hand."""

from functools import partial

import pytest

from infthor_eval.generation.questions import counting
from infthor_eval.generation.twins.pairing import AskedWorld, pair_questions
from infthor_eval.nieh.scoring import score

from ..questions.logs import history, moved, state

TABLE, DESK, FRIDGE = "DiningTable|1|0|0", "Desk|1|0|0", "Fridge|1|0|0"
MUG, APPLE, BOOK = "Mug|1|0|0", "Apple|1|0|0", "Book|1|0|0"
PLACES = {key: state(key) for key in (TABLE, DESK, FRIDGE)}
STRICT = partial(score, scorer="strict")


def paired(first, second, *types, scorer=STRICT):
    """The paired questions by their text."""
    changed = frozenset(key for key in (MUG, APPLE, BOOK) if key.partition("|")[0] in types)
    worlds = (AskedWorld.of(first.steps, changed, 0), AskedWorld.of(second.steps, changed, 0))
    return {pair.text: pair for pair in pair_questions(worlds, frozenset(types), scorer)}


def put(item, target, other=APPLE):
    """A log in which one of two things is put somewhere."""
    start = {**PLACES, item: state(item, TABLE), other: state(other, TABLE)}
    return history(start, *moved(item, TABLE, target))


def test_what_is_asked_in_both_worlds_has_both_answers_and_the_union_of_the_clues():
    pairs = paired(put(MUG, DESK), put(MUG, FRIDGE), "Mug", "Desk", "Fridge")
    where = pairs["Where did you move the mug to?"]
    assert where.answers == (("desk",), ("fridge",))
    assert set(where.clues) == {*where.own_clues[0], *where.own_clues[1]}
    assert where.overlap == (0, 0)
    assert where.fact == "location_tracing: Mug"


def test_what_the_rules_ask_in_one_world_is_answered_in_the_other():
    pairs = paired(put(MUG, DESK), put(APPLE, DESK, MUG), "Mug", "Apple")
    there = pairs["Is the mug on the desk?"]
    assert there.answers == (("yes",), ("no",))
    assert there.own_clues[1] == ()


def test_the_order_of_two_things():
    start = {**PLACES, MUG: state(MUG, TABLE), APPLE: state(APPLE, TABLE)}
    one = moved(MUG, TABLE, DESK)
    other = moved(APPLE, TABLE, DESK)
    pairs = paired(history(start, *one, *other), history(start, *other, *one), "Mug", "Apple")
    assert pairs["Did you pick up the mug before the apple?"].answers == (("yes",), ("no",))
    assert pairs["Did you pick up the apple before the mug?"].answers == (("no",), ("yes",))


def test_how_often_a_thing_was_moved_is_told_by_the_hand():
    start = {**PLACES, MUG: state(MUG, TABLE), BOOK: state(BOOK, TABLE)}
    mug = moved(MUG, TABLE, TABLE)
    worlds = history(start, *mug * 3), history(start, *mug * 2, *moved(BOOK, TABLE, TABLE))
    times = paired(*worlds, "Mug", "Book")["How many times did you move the mug?"]
    assert times.answers == (("3",), ("2",))
    assert times.clues == (1, 2, 3, 4, 5, 6)  # in the last two the hand holds the book in one world


def test_a_count_of_all_objects_is_about_no_type():
    start = {**PLACES, MUG: state(MUG, TABLE), BOOK: state(BOOK, TABLE)}
    mug = moved(MUG, TABLE, TABLE)
    idle = (("MoveAhead", None, None, {}),) * 12
    worlds = (
        history(start, *mug * 2, *idle),
        history(start, *mug, *moved(BOOK, TABLE, TABLE), *idle),
    )
    text = "How many different objects did you pick up?"
    assert text not in paired(*worlds, "Mug", "Book")
    assert paired(*worlds, "Mug", "Book", counting.ALL)[text].answers == (("1",), ("2",))


@pytest.mark.parametrize("taken", [False, True])
def test_how_many_things_there_were_is_not_asked_where_one_was_taken_away(taken):
    start = {**PLACES, MUG: state(MUG, TABLE), APPLE: state(APPLE, DESK if taken else TABLE)}
    apple = moved(APPLE, DESK, TABLE) if taken else moved(APPLE, TABLE, FRIDGE)
    done = (*apple, *moved(MUG, TABLE, DESK))
    first = history({**start, BOOK: state(BOOK, DESK)}, *done)
    second = history({**start, BOOK: state(BOOK, TABLE)}, *done)
    pairs = paired(first, second, "Book", "Desk")
    assert ("How many objects were on the desk?" in pairs) == (not taken)
    assert "What objects are on the desk?" in pairs


def test_equal_answers_are_no_pair():
    assert not paired(put(MUG, DESK), put(MUG, DESK), "Mug")


@pytest.mark.parametrize("mark", [1.0, 0.5])
def test_answers_that_the_scorer_takes_for_each_other_or_not_for_right_are_no_pair(mark):
    worlds = put(MUG, DESK), put(MUG, FRIDGE)
    assert not paired(*worlds, "Mug", scorer=lambda reply, answers: mark)


def test_a_side_effect_is_not_asked_for():
    start = {**PLACES, MUG: state(MUG, TABLE), BOOK: state(BOOK, TABLE)}
    first = history(start, *moved(MUG, TABLE, DESK))
    second = history({**start, BOOK: state(BOOK, DESK)}, *moved(MUG, TABLE, FRIDGE))
    assert not any("book" in text for text in paired(first, second, "Mug"))


@pytest.mark.parametrize("shown", [True, False])
def test_both_answers_must_follow_from_the_clues(shown):
    second = put(MUG, FRIDGE)
    if not shown:
        for step in second.steps:
            step.seen = {}
    assert ("Where did you move the mug to?" in paired(put(MUG, DESK), second, "Mug")) == shown


def test_a_placebo_differs_in_a_clue_frame_and_not_in_its_answer():
    first, second = put(MUG, DESK), put(MUG, FRIDGE)
    worlds = tuple(AskedWorld.of(log.steps, frozenset({MUG}), 0) for log in (first, second))
    types = frozenset({"Mug", "Desk", "Fridge"})
    by_frames = {
        frame: [pair for pair in pair_questions(worlds, types, STRICT, {frame}) if pair.is_placebo]
        for frame in (0, 1)
    }
    for frame, placebos in by_frames.items():
        assert 0 < len(placebos) <= 2
        for placebo in placebos:
            assert frame in placebo.clues
            assert placebo.answers[0] == placebo.answers[1] and not any(placebo.absence)
            assert placebo.fact == "placebo: Desk, Fridge, Mug"
            assert all(world.checker.answers(placebo.text) for world in worlds)
    assert not any(pair.is_placebo for pair in pair_questions(worlds, types, STRICT))


def test_a_world_until_a_moment_knows_nothing_of_later():
    world = AskedWorld.of(put(MUG, DESK).steps, frozenset({MUG}), 0)
    assert "Where did you move the mug to?" in world.candidates(frozenset())
    assert "Where did you move the mug to?" not in world.until(1).candidates(frozenset())
    assert len(world.until(1).history) == 2
