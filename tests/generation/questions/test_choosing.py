"""The choice of questions, on candidates that nobody observed."""

import random
from collections import Counter, defaultdict

from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.generate import Chooser

OBJECTS = ("Mug", "Fridge", "Sofa", "Bed")
FORMS = {
    "presence": ("yes", "no"),
    "counting": ("1", "2", "3", "4"),
    "location": ("sink", "table", "desk"),
}


@st.composite
def candidates(draw):
    drawn = []
    for at in range(draw(st.integers(0, 25))):
        form = draw(st.sampled_from(sorted(FORMS)))
        thing, answer = draw(st.sampled_from(OBJECTS)), draw(st.sampled_from(FORMS[form]))
        drawn.append(
            Candidate(form, f"{form} {{}}?", (f"{thing} {at}",), (at,), (answer,), (thing,))
        )
    return drawn


TRAJECTORIES = st.lists(
    st.tuples(st.sampled_from(["Kitchen", "Bedroom"]), candidates()), max_size=6
)


def counted(trajectories, **options):
    chooser, by_form, by_object = Chooser(**options), defaultdict(Counter), defaultdict(Counter)
    for number, (rooms, offered) in enumerate(trajectories):
        chosen = chooser.choose(offered, 12, random.Random(number), rooms)
        assert len(chosen) <= 12 and set(chosen) <= set(offered) and len(set(chosen)) == len(chosen)
        for item in chosen:
            by_form[item.form][item.answers[0]] += 1
            by_object[item.form, rooms, item.subjects[0]][item.answers[0]] += 1
    return by_form, by_object


@given(TRAJECTORIES)
def test_no_answer_leads_to_a_form_nor_on_an_object_in_a_kind_of_room(trajectories):
    for counts in (count for by in counted(trajectories) for count in by.values()):
        most, *others = sorted(counts.values(), reverse=True)
        # One ahead of the mean of the next ones: it was chosen when it did not lead them yet.
        n_next = 1 if set(counts) <= {"yes", "no"} else 3 if set(counts) <= set("1234") else 6
        assert (most - 1) * n_next <= sum(others[:n_next])


@given(TRAJECTORIES)
def test_without_subjects_yes_no_and_numbers_alone_are_held(trajectories):
    by_form, _ = counted(trajectories, by_subject=False)
    for form, counts in by_form.items():
        most, *others = sorted(counts.values(), reverse=True)
        assert form == "location {}?" or most - 1 <= sum(others)


def test_an_answer_that_always_holds_of_an_object_is_asked_for_once_in_each_kind_of_room():
    def always(number):
        return [
            Candidate("presence", "Is there {}?", ("a fridge",), (number,), ("yes",), ("Fridge",))
        ]

    chooser = Chooser()
    rooms = ["Kitchen", "Bedroom", "Kitchen", "Kitchen", "Bedroom"]
    chosen = [
        chooser.choose(always(at), 5, random.Random(at), room) for at, room in enumerate(rooms)
    ]
    assert sum(map(len, chosen)) == 1  # the form has no other answer yet
    no = Candidate("presence", "Is there {}?", ("a mug",), (0,), ("no",), ("Mug",))
    assert chooser.choose([no], 5, random.Random(0), "Kitchen") == [no]
    assert len(chooser.choose(always(9), 5, random.Random(9), "Bedroom")) == 1
    assert not chooser.choose(always(10), 5, random.Random(10), "Bedroom")
