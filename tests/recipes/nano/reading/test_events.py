from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.step_log import read_steps
from recipes.nano.reading.events import Event, Happening, events_in, read_events

PICKED_UP = Happening(3, Event.PICKED_UP, "Mug")
OPENED = Happening(5, Event.OPENED, "Fridge")


def test_events_of_a_trajectory_are_its_actions_on_things(small_set):
    data = NiehSet(small_set)
    folder = data.folder(sorted({question.traj_id for question in data.questions})[0])
    happenings = read_events(folder)
    steps = sorted(read_steps(folder), key=lambda step: step.img_idx)
    expected = {
        (place, object_type_of(step.target))
        for place, step in enumerate(steps)
        if step.success and (step.action or "").startswith("PutObject")
    }
    put = {(one.place, one.type) for one in happenings if one.event is Event.PUT}
    assert put == expected
    assert put
    # What was put down had been picked up, and what it was put into is told, too.
    for place, name in put:
        (held,) = [
            one.event
            for one in happenings
            if one.place < place and one.type == name and one.event in (Event.PUT, Event.PICKED_UP)
        ][-1:]
        assert held is Event.PICKED_UP
        assert [one.event for one in happenings if one.place == place][1:] == [Event.PUT_INTO]


def test_what_happened_is_told_at_the_first_frame_after_it():
    assert events_in([PICKED_UP, OPENED], [1, 3, 4, 6]) == [
        None,
        [(Event.PICKED_UP, "Mug")],
        [],
        [(Event.OPENED, "Fridge")],
    ]


def test_frames_that_are_far_apart_are_not_compared():
    assert events_in([PICKED_UP, OPENED], [0, 4, 5]) == [None, None, [(Event.OPENED, "Fridge")]]


@given(st.sets(st.integers(0, 9)))
def test_nothing_is_told_twice(places):
    told = events_in([PICKED_UP, OPENED], sorted(places))
    assert len(told) == len(places)
    flat = [event for events in told for event in events or ()]
    assert len(flat) == len(set(flat))
