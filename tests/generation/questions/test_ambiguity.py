"""What is asked only where it is clear what is meant, on logs made by hand."""

import random
from dataclasses import replace

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.generation.questions import (
    contents,
    counting,
    final_state,
    location,
    open_state,
    presence,
    put_action,
)
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.facts import facts_shown, frame_facts
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.generation.questions.rooms import rooms_of
from infthor_eval.thor.recorder import Recorder

from .logs import history, moved, state

TABLE, DESK, FRIDGE = "DiningTable|1", "Desk|1", "Fridge|1"
APPLE, MUG, BOOK, EGG, PAN = "Apple|1", "Mug|1", "Book|1", "Egg|1", "Pan|1"
PLACES = {key: state(key) for key in (TABLE, DESK, FRIDGE)}
LOOK = ("LookUp", None, None, {})
FAR = (9.0, 0.0, 9.0)


def texts(candidates):
    return [candidate.text for candidate in candidates]


def check(log, candidates):
    checked, checker = list(candidates), Checker(log.steps, DEFAULT_SHARE)
    for candidate in checked:
        assert checker.verdict(candidate.question("made")).sound, candidate
    return {candidate.text: candidate.answers for candidate in checked}


def test_contents_are_asked_of_what_never_changes():
    log = history(
        {**PLACES, APPLE: state(APPLE, TABLE), MUG: state(MUG, TABLE), BOOK: state(BOOK, DESK)}
    )
    assert check(log, contents.contents(log)) == {
        "What objects were on the dining table?": ("apple", "mug"),
        "What objects were on the desk?": ("book",),
    }
    changed = history({**PLACES, APPLE: state(APPLE, TABLE)}, *moved(APPLE, TABLE, FRIDGE))
    assert not texts(contents.contents(changed))


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({}, True),
        ({"DeskLamp|1": state("DeskLamp|1", position=FAR)}, True),
        ({"DeskLamp|1": state("DeskLamp|1")}, False),
        ({"DeskLamp|1": state("DeskLamp|1", TABLE, position=FAR)}, False),
        ({PAN: state(PAN, TABLE), EGG: state(EGG, PAN)}, False),
        ({"DiningTable|2": state("DiningTable|2")}, False),
    ],
)
def test_contents_are_asked_where_every_reading_gives_the_same(more, expected):
    log = history({**PLACES, MUG: state(MUG, TABLE), **more})
    assert any("dining table" in text for text in texts(contents.contents(log))) == expected


def test_further_contents_say_what_counts_and_count_it_so():
    lamp = "DeskLamp|1"
    loose = {PAN: state(PAN, TABLE), EGG: state(EGG, PAN), MUG: state(MUG, TABLE)}
    start = {**PLACES, **loose, BOOK: state(BOOK, TABLE), lamp: state(lamp, TABLE)}
    log = history(start, *moved(BOOK, TABLE, DESK))
    ((text, answers),) = check(log, contents.at_pickup(log)).items()
    assert text.startswith(f"{AT_PICKUP}picked")
    assert answers == ("mug", "pan")


AT_PICKUP = "Which other things that can be picked up were directly on the dining table when you "


@pytest.mark.parametrize(
    ("unseen", "carried", "clues"),
    [
        ({}, 3, (1,)),
        ({1: [MUG]}, 3, (2,)),  # the book is still in the hand there, so the first is needless
        ({1: [MUG], 2: [PAN]}, 3, (1, 2)),  # neither shows all
        ({1: [MUG], 2: [MUG], 3: [PAN]}, 2, (1, 3)),  # put down before the mug is seen
        ({1: [MUG], 2: [MUG]}, 2, (1, 3)),  # as before: without the first nothing says when
    ],
)
def test_of_what_was_left_a_later_clue_makes_the_first_needless_while_it_is_held(
    unseen, carried, clues
):
    start = {**PLACES, **{key: state(key, TABLE) for key in (MUG, PAN, BOOK)}}
    pick, put = moved(BOOK, TABLE, DESK)
    waits = [("MoveAhead", None, None, {})] * 3
    events = [pick, *waits]
    events[carried] = put
    log = history(start, *events)
    for frame, keys in unseen.items():
        for key in keys:
            del log.steps[frame].seen[key]
    (candidate,) = contents.at_pickup(log)
    assert candidate.text.startswith(AT_PICKUP)
    assert candidate.clues == clues
    assert check(log, [candidate]) == {candidate.text: ("mug", "pan")}


@pytest.mark.parametrize(("closed", "clues"), [(False, (2,)), (True, (1, 2))])
def test_of_a_first_opening_a_later_clue_makes_the_first_needless_while_it_is_open(closed, clues):
    start = {**PLACES, **{key: state(key, FRIDGE) for key in (MUG, PAN)}}
    start[FRIDGE] = state(FRIDGE, is_open=False)
    log = history(
        start,
        ("OpenObject", FRIDGE, None, {FRIDGE: state(FRIDGE, is_open=True)}),
        ("MoveAhead", None, None, {FRIDGE: state(FRIDGE, is_open=not closed)}),
    )
    del log.steps[1].seen[MUG]
    (candidate,) = contents.at_opening(log)
    assert candidate.clues == clues
    assert check(log, [candidate]) == {candidate.text: ("mug", "pan")}


def test_the_end_is_counted_where_every_reading_gives_the_same():
    start = {**PLACES, APPLE: state(APPLE, TABLE), MUG: state(MUG, TABLE)}
    log = history(start, *moved(APPLE, TABLE, DESK))
    assert check(log, final_state.final_states(log)) == {
        "Is the apple on the desk?": ("yes",),
        "How many objects were on the desk?": ("1",),
        "What objects are on the desk?": ("apple",),
    }
    lamp = history({**start, "DeskLamp|1": state("DeskLamp|1")}, *moved(APPLE, TABLE, DESK))
    assert texts(final_state.final_states(lamp)) == ["Is the apple on the desk?"]


def test_which_pickup_is_meant_is_clear():
    start = {**PLACES, APPLE: state(APPLE, TABLE)}
    once = history(start, *moved(APPLE, TABLE, FRIDGE))
    assert check(once, location.locations(once)) == {
        "Where was the apple before you put it in the fridge?": ("diningtable",),
        "Where did you move the apple from the dining table?": ("fridge",),
        "Where is the apple now?": ("fridge",),
    }
    assert "Where was the apple before you picked it up?" in check(
        once, location.further_locations(once)
    )
    held = history(start, *moved(APPLE, TABLE, FRIDGE), moved(APPLE, FRIDGE, DESK)[0])
    asked = texts(location.locations(held))
    assert not [text for text in asked if "move the" in text or "now" in text]
    further = texts(location.further_locations(held))
    assert "Where was the apple before you picked it up?" not in further
    assert "Where did you move the apple to?" not in further
    assert "Where was the apple before you first picked it up?" in further


def test_of_several_moves_only_those_at_the_ends_are_asked_about():
    start = {**PLACES, APPLE: state(APPLE, TABLE)}
    twice = history(start, *moved(APPLE, TABLE, FRIDGE), *moved(APPLE, FRIDGE, DESK))
    assert check(twice, location.locations(twice)) == {
        "Where was the apple before you put it in the fridge?": ("diningtable",),
        "Where did you move the apple from the fridge?": ("desk",),
        "Where is the apple now?": ("desk",),
    }
    back = history(
        start,
        *moved(APPLE, TABLE, FRIDGE),
        *moved(APPLE, FRIDGE, DESK),
        *moved(APPLE, DESK, FRIDGE),
    )
    assert not [text for text in texts(location.locations(back)) if "before you put" in text]


def test_a_put_is_shown_by_what_was_in_the_hand_before():
    start = {**PLACES, APPLE: state(APPLE, TABLE), MUG: state(MUG, DESK)}
    log = history(start, *moved(APPLE, TABLE, DESK), *moved(MUG, DESK, FRIDGE))
    puts = list(put_action.further_puts(log))
    assert check(log, puts) == {
        "What did you put down?": ("apple", "mug"),
        "Where did you put things?": ("desk", "fridge"),
    }
    assert {candidate.clues for candidate in puts} == {(1, 2, 3, 4)}
    # What lies on the desk alone does not tell what was put there.
    for question in (candidate.question("made") for candidate in puts):
        after = replace(question, clues=(2, 4))
        assert not Checker(log.steps, DEFAULT_SHARE).verdict(after).sufficient


@pytest.mark.parametrize(
    ("item", "inside", "top_inside", "asked"),
    [
        ("Box|1", 0.5, 0.5, True),
        ("Box|1", 0.7, 0.0, False),  # its flaps are above the picture
        (FRIDGE, 0.5, 0.0, True),
        (FRIDGE, 0.4, 1.0, False),
    ],
)
def test_whether_something_was_open_is_asked_where_a_frame_shows_it(
    item, inside, top_inside, asked
):
    log = history({item: state(item, is_open=True)})
    shown = log.steps[0].seen[item]
    shown.inside, shown.top_inside = inside, top_inside
    assert bool(list(open_state.open_states(log))) == asked
    assert bool(list(open_state.further_open_states(log))) == asked


@pytest.mark.parametrize(("inside", "seen"), [(0.25, True), (0.24, False)])
def test_a_sliver_at_the_edge_shows_nothing(inside, seen):
    log = history({**PLACES, APPLE: state(APPLE, TABLE)})
    log.steps[0].seen[APPLE].inside = inside
    assert log.shows(0, APPLE) == seen


def test_an_opening_is_shown_by_what_was_closed_before():
    closed, opened = (state(FRIDGE, is_open=is_open) for is_open in (False, True))
    log = history(
        {**PLACES, FRIDGE: closed},
        LOOK,
        ("OpenObject", FRIDGE, None, {FRIDGE: opened}),
    )
    text = "What did you open?"
    (asked,) = (item for item in open_state.further_open_states(log) if item.text == text)
    assert check(log, [asked]) == {text: ("fridge",)}
    assert asked.clues == (1, 2)


@pytest.mark.parametrize(
    ("box", "expected"), [((200, 200, 220, 220), True), ((110, 110, 130, 130), False)]
)
def test_two_of_a_type_are_counted_where_they_are_seen_apart(box, expected):
    other = "Apple|2"
    start = {**PLACES, APPLE: state(APPLE, TABLE), other: state(other, DESK)}
    boxes = {number: {other: box} for number in range(3)}
    log = history(start, *moved(APPLE, TABLE, DESK), boxes=boxes)
    asked = texts(final_state.final_states(log))
    assert ("How many objects were on the desk?" in asked) == expected


def test_different_objects_are_counted_if_none_looks_like_another():
    other = "Apple|2"
    start = {**PLACES, **{key: state(key, TABLE) for key in (APPLE, other, MUG)}}
    for second, expected in ((MUG, True), (other, False)):
        log = history(start, *moved(APPLE, TABLE, DESK), *moved(second, TABLE, DESK), *[LOOK] * 20)
        counted = check(log, counting.further_counts(log, random.Random(0)))
        assert ("How many different objects did you pick up?" in counted) == expected


def test_moves_are_counted_of_what_was_moved_more_than_once():
    start = {**PLACES, APPLE: state(APPLE, TABLE), MUG: state(MUG, TABLE)}
    log = history(
        start, *moved(APPLE, TABLE, FRIDGE), *moved(MUG, TABLE, DESK), *moved(APPLE, FRIDGE, DESK)
    )
    assert check(log, counting.counts(log)) == {"How many times did you move the apple?": ("2",)}


def test_the_best_sighting_is_shown():
    boxes = {0: {MUG: (0, 100, 20, 120)}}
    log = history({**PLACES, MUG: state(MUG, TABLE)}, LOOK, LOOK, boxes=boxes)
    clues = {candidate.text: candidate.clues for candidate in presence.yes_questions(log)}
    assert clues["Have you seen a mug?"] == clues["Is there any mug in this room?"] == (1,)
    assert clues["Have you seen a fridge?"] == (0,)


def test_an_absence_has_a_clue_of_a_presence_of_its_kind():
    boxes = {number: {MUG: (0, 100, 20, 120)} for number in (0, 1, 3)}
    boxes[0] |= dict.fromkeys(PLACES, (0, 0, 40, 40))
    log = history({**PLACES, MUG: state(MUG, TABLE)}, LOOK, LOOK, LOOK, boxes=boxes)
    vocabulary = frozenset({"Toaster", "Cup", "Bread", "Egg", "Fork", "Potato", "Tomato", "Kettle"})
    absences = list(presence.no_questions(log, vocabulary, random.Random(0)))
    clues = {candidate.subjects[0]: candidate.clues for candidate in absences}
    assert clues["Bread"] == clues["Potato"] == (2,)  # where the mug is seen best
    assert clues["Toaster"] == (1,)  # where the tables are


def test_no_room_is_meant_in_a_house_of_several():
    rooms = {"Floor|1": state("Floor|1"), "Floor|2": state("Floor|2")}
    for floors, forms in (
        (dict(list(rooms.items())[:1]), {"Is there any", "Have you seen"}),
        (rooms, {"Have you seen"}),
    ):
        log = history({**PLACES, **floors, MUG: state(MUG, TABLE)})
        candidates = [
            *presence.yes_questions(log),
            *presence.no_questions(log, frozenset({"Toaster"}), random.Random(0)),
        ]
        assert {" ".join(candidate.text.split()[:3]) for candidate in candidates} == forms
        assert {candidate.answers for candidate in candidates} == {("yes",), ("no",)}


def test_what_no_frame_shows_was_not_seen_but_is_in_the_room():
    log = history({**PLACES, MUG: state(MUG, FRIDGE)}, LOOK)
    for step in log.steps:
        del step.seen[MUG]
    log = TrajectoryHistory("made", log.steps)
    candidates = list(presence.no_questions(log, frozenset({"Mug", "Toaster"}), random.Random(0)))
    texts_on_mugs = {candidate.text for candidate in candidates if candidate.subjects == ("Mug",)}
    assert texts_on_mugs == {"Have you seen a mug?"}
    checker = Checker(log.steps, DEFAULT_SHARE)
    assert all(checker.verdict(candidate.question("made")).sound for candidate in candidates)
    absence = Question("made", "Is there any mug in this room?", (0,), ("no",))
    assert not checker.verdict(absence).right


def test_absences_are_of_what_rooms_of_the_kind_have():
    bathroom = history({"Toilet|1": state("Toilet|1"), "Sink|1": state("Sink|1")})
    absences = presence.no_questions(bathroom, frozenset(), random.Random(0))
    absent = {item.subjects[0] for item in absences}
    assert "Plunger" in absent and not absent & {"Toaster", "Bed", "Toilet"}


@pytest.mark.parametrize(
    ("types", "rooms"),
    [
        ({"Toilet", "Sink"}, "Bathroom"),
        ({"Bed", "Sofa"}, "Bedroom"),
        ({"Fridge"}, "Kitchen"),
        ({"Television"}, "LivingRoom"),
        ({"Fridge", "Bed", "Toilet", "Sofa"}, "Kitchen, Bedroom, Bathroom, LivingRoom"),
    ],
)
def test_rooms_are_told_by_what_stands_in_them(types, rooms):
    assert rooms_of(types) == rooms


def test_the_rules_know_a_house_by_its_floors(simulator):
    for scene, has_rooms in (("house-1", True), ("kitchen-1", False)):
        recorder = Recorder()
        recorder.record(simulator.reset(scene))
        assert TrajectoryHistory(scene, recorder.steps).has_rooms is has_rooms


def test_a_view_well_inside_the_frame_is_preferred():
    start = {**PLACES, FRIDGE: state(FRIDGE, is_open=False)}
    log = history(
        start, LOOK, LOOK, boxes={0: {FRIDGE: (0, 0, 20, 20)}, 1: {FRIDGE: (10, 50, 30, 70)}}
    )
    (candidate,) = open_state.open_states(log)
    assert candidate.text == "Was the fridge open?"
    assert (candidate.answers, candidate.clues) == (("no",), (2,))
    opened = history(
        start, ("OpenObject", FRIDGE, None, {FRIDGE: state(FRIDGE, is_open=True)}), LOOK
    )
    (candidate,) = open_state.open_states(opened)
    assert (candidate.answers, candidate.clues) == (("yes",), (1,))


def test_a_fork_must_fill_more_of_a_frame_than_a_knife_to_count_as_shown():
    both = {"Fork|1", "Knife|1"}
    for pixels, shown in ((89, set()), (90, {"Knife|1"}), (179, {"Knife|1"}), (180, both)):
        log = history({key: state(key, "Desk|1") for key in ("Desk|1", "Fork|1", "Knife|1")})
        for key in both:
            log.steps[0].seen[key] = ObjectInFrame(pixels, (100, 100, 120, 120), True)
        (facts,) = facts_shown(log.steps, frame_facts(log.steps), DEFAULT_SHARE)
        assert {key for key in both if log.shows(0, key)} == shown
        assert set(facts.objects) - {"Desk|1"} == shown
