"""Questions on a few events in a row, worked out by hand."""

import random
from types import SimpleNamespace

import pytest

from recipes.nano.reading.episodes import World, read_episodes
from recipes.nano.reading.events import Event, Happening
from recipes.nano.reading.question_sampler import EventQuestions
from recipes.nano.seen_objects import SeenFrame, SeenObject, read_seen_frames

# A mug is moved from a table to a shelf and on to the sink, and a plate from a cabinet to the sink.
EVENTS = (
    (2, Event.PICKED_UP, "Mug", Event.PICKED_UP_FROM, "CoffeeTable"),
    (5, Event.PUT, "Mug", Event.PUT_INTO, "Shelf"),
    (8, Event.PICKED_UP, "Mug", Event.PICKED_UP_FROM, "Shelf"),
    (10, Event.PUT, "Mug", Event.PUT_INTO, "Sink"),
    (12, Event.OPENED, "Cabinet", None, None),
    (13, Event.PICKED_UP, "Plate", Event.PICKED_UP_FROM, "Cabinet"),
    (14, Event.CLOSED, "Cabinet", None, None),
    (18, Event.PUT, "Plate", Event.PUT_INTO, "Sink"),
)
N_FRAMES = 20


def episode(hidden=()):
    """The episode's world, with frames of which some do not show the mug."""
    frames = tuple(SimpleNamespace(digest=str(at)) for at in range(N_FRAMES))
    happenings = []
    for place, event, thing, of_place, where in EVENTS:
        happenings.append(Happening(place, event, thing))
        happenings += [Happening(place, of_place, where)] if of_place is not None else []
    seen = {}
    for at, frame in enumerate(frames):
        names = {"Mug", "Plate", "Cabinet"} - ({"Mug"} if at in hidden else set())
        objects = tuple(SeenObject(name, (0, 0, 50, 50), True) for name in sorted(names))
        seen[str(at)] = SeenFrame(frame, objects)
    return World(frames, tuple(happenings)), EventQuestions(seen)


def answers(places):
    world, questions = episode()
    return dict(questions.ask(world, places, 100, random.Random(0)))


def test_all_events_of_the_episode():
    asked = answers(range(N_FRAMES))
    openings = {text: answer for text, answer in asked.items() if "open" in text}
    assert {*openings.values()} == {"1", "cabinet"}
    assert {text: answer for text, answer in asked.items() if text not in openings} == {
        "How many times did you put something on the shelf?": "1",
        "What object did you put on the shelf?": "mug",
        "How many times did you put something in the sink?": "2",
        "What did you put in the sink?": "mug, plate",
        "How many times did you move the mug?": "2",
        "Where did you move the mug to?": "sink",
        "How many times did you move the plate?": "1",
        "Where did you move the plate to?": "sink",
        "What did you put down?": "mug, plate",
        "Where did you put things?": "shelf, sink",
        "What did you pick up first?": "mug",
        "How many different objects did you pick up?": "2",
        "Where was the plate before you picked it up?": "cabinet",
        **{text: answer for text, answer in asked.items() if "before the" in text},
    }


def test_only_what_successive_frames_show_is_asked_about():
    assert answers([4, 5]) == {
        "How many times did you put something on the shelf?": "1",
        "What object did you put on the shelf?": "mug",
        "How many times did you move the mug?": "1",
        "Where did you move the mug to?": "shelf",
        "What did you put down?": "mug",
        "Where did you put things?": "shelf",
    }
    assert not answers([5, 7, 10])


def test_order_of_two_things():
    texts = {
        "Did you pick up the mug before the plate?": "yes",
        "Did you pick up the plate before the mug?": "no",
    }
    world, questions = episode()
    found = {}
    for seed in range(20):
        found |= dict(questions.ask(world, range(N_FRAMES), 100, random.Random(seed)))
    assert {text: found[text] for text in texts} == texts


@pytest.mark.parametrize("n", [1, 2, 4])
def test_places_are_those_around_events_in_a_row(n):
    world, questions = episode()
    busy = sorted({place for place, event, *_ in EVENTS if event != Event.CLOSED})
    for seed in range(30):
        places = questions.draw_places(world, n, random.Random(seed))
        shown = [at for at in busy if {at - 1, at} <= {*places}]
        assert len(shown) >= n
        at = busy.index(shown[0])
        assert shown == busy[at : at + len(shown)]


def test_events_that_frames_do_not_show_are_not_asked_about():
    world, questions = episode(hidden=(5,))
    for seed in range(30):
        places = questions.draw_places(world, 2, random.Random(seed))
        assert not {4, 5} <= {*places} or not places


def test_answers_agree_with_recorded_questions(small_set):
    """The rules of recorded questions are others; where both ask, they answer alike."""
    seen = {one.frame.digest: one for one in read_seen_frames([small_set])}
    questions = EventQuestions(seen)
    n = 0
    for episode_ in read_episodes([small_set])[0]:
        (world,) = episode_.worlds
        asked = dict(questions.ask(world, range(episode_.n_frames), 1000, random.Random(0)))
        for recorded in episode_.questions:
            answer = asked.get(recorded.asked[0].text)
            if answer is not None:
                n += 1
                assert answer == ", ".join(map(str, recorded.asked[0].answers))
    assert n > 5
