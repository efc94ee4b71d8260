from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters import ROLES, Reply, Transcript, Turn

from .asking import up_to, user


def test_touching_texts_are_one(frames):
    talk = Transcript()
    talk.append("a", "b", "", frames[0])
    talk.append("", "c")
    talk.append("d")
    assert talk.turns == user("ab", frames[0], "cd")


def test_turns_are_told_apart_by_who_speaks(frames):
    talk = Transcript()
    talk.append("Be brief.", role="system")
    talk.append(frames[0])
    talk.append("What", " is it?")
    talk.append("A mug", role="assistant")
    talk.append(".", role="assistant")
    talk.append("Sure?")
    assert talk.turns == (
        Turn("system", ("Be brief.",)),
        Turn("user", (frames[0], "What is it?")),
        Turn("assistant", ("A mug.",)),
        Turn("user", ("Sure?",)),
    )


def test_a_turn_of_nothing_is_none_and_its_neighbours_touch():
    talk = Transcript()
    talk.append("a")
    talk.append("", role="assistant")
    talk.append("b")
    assert talk.turns == user("ab")


SAID = st.lists(
    st.tuples(
        st.sampled_from(ROLES),
        st.lists(st.one_of(st.text("ab", max_size=2), st.integers(0, 5)), max_size=3),
    ),
    max_size=8,
)


def _append(talk, message, frames):
    for role, numbered in message:
        talk.append(
            *(frames[part] if isinstance(part, int) else part for part in numbered), role=role
        )


def _letters(message):
    whole = [
        (role, part if isinstance(part, str) else [part])
        for role, parts in message
        for part in parts
    ]
    return [(role, each) for role, part in whole for each in part]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(message=SAID, more=SAID)
def test_turns_hold_what_was_said_and_leave_no_joint(frames, message, more):
    talk = Transcript()
    _append(talk, message, frames)
    turns, here = talk.turns, talk.mark()
    numbered = [
        (turn.role, [part if isinstance(part, str) else frames.index(part) for part in turn.parts])
        for turn in turns
    ]
    assert _letters(numbered) == _letters(message)
    assert all(turn.parts for turn in turns)
    assert all(one.role != other.role for one, other in pairwise(turns))
    assert not any(
        isinstance(one, str) and isinstance(other, str)
        for turn in turns
        for one, other in pairwise(turn.parts)
    )
    _append(talk, more, frames)
    talk.rewind(here)
    assert talk.turns == turns


def test_a_mark_serves_many_rewinds():
    talk = Transcript()
    talk.append("a")
    mark = talk.mark()
    for text in "bc":
        talk.append(text)
        assert talk.turns == user("a" + text)
        talk.rewind(mark)
        assert talk.turns == user("a")


def test_nested_marks_unwind_in_order():
    talk = Transcript()
    outer = talk.mark()
    talk.append("a")
    inner = talk.mark()
    talk.append("b", role="assistant")
    talk.rewind(inner)
    talk.rewind(outer)
    assert talk.turns == ()
    with pytest.raises(ValueError, match="mark"):
        talk.rewind(inner)


def test_a_mark_of_another_conversation_is_refused():
    talk, other = Transcript(), Transcript()
    talk.mark()
    with pytest.raises(ValueError, match="another conversation"):
        talk.rewind(other.mark())


def test_a_late_mark_stays_dead_after_growing_back():
    talk = Transcript()
    start = talk.mark()
    talk.append("a")
    late = talk.mark()
    talk.rewind(start)
    talk.append("b")
    with pytest.raises(ValueError, match="rewound"):
        talk.rewind(late)


def test_a_refused_part_leaves_nothing_behind():
    talk = Transcript()
    with pytest.raises(TypeError, match="int"):
        talk.append("a", 3)
    with pytest.raises(ValueError, match="no role 'narrator'; roles: system, user, assistant"):
        talk.append("a", role="narrator")
    assert talk.turns == ()


class Echo(Transcript):
    """Says how many letters it has heard, and nothing to a question mark."""

    n_tokens = None

    def reply(self, decoding):
        heard = "".join(str(part) for turn in self.turns for part in turn.parts)
        if "?" in heard:
            raise ModelError("no questions")
        return Reply(str(len(heard))[: decoding.max_new_tokens])


@pytest.mark.parametrize("continuations", [[], [["b"]], [["b", "c"], ["dddd"], []]])
def test_continuations_are_answered_one_by_one(continuations):
    talk = Echo()
    talk.append("a")
    expected = [str(1 + sum(len(str(part)) for part in parts)) for parts in continuations]
    assert [reply.text for reply in talk.replies(continuations, up_to(3))] == expected
    assert talk.turns == user("a")


def test_a_continuation_that_is_refused_is_forgotten():
    talk = Echo()
    talk.append("a")
    with pytest.raises(ModelError, match="no questions"):
        talk.replies([["b"], ["c?"]], up_to(3))
    assert talk.turns == user("a")
