"""Memories that recall frames by their place."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.memory import tokens_of
from infthor_eval.memory.frames import Last, Oracle, Random, Uniform

ALL = (Last, Uniform, Random, Oracle)
budgets = st.none() | st.integers(0, 400)


def numbers(recalled):
    return [item.number for item in recalled]


@given(
    kind=st.sampled_from(ALL),
    n_past=st.integers(0, 40),
    budget=budgets,
    k=st.integers(1, 50),
    data=st.data(),
)
def test_frames_are_distinct_in_time_order_and_as_many_as_there_is_room_for(
    observed, kind, n_past, budget, k, data
):
    clues = tuple(sorted(data.draw(st.sets(st.integers(0, max(0, n_past)), max_size=5))))
    recalled = observed(kind(k=k), n_past)(budget=budget, clues=clues)
    frame_numbers = numbers(recalled)
    assert frame_numbers == sorted(set(frame_numbers))
    assert set(frame_numbers) <= set(range(n_past))
    assert len(frame_numbers) == min(n_past, k if budget is None else budget // 10)
    assert budget is None or tokens_of(recalled, 10) <= budget


@given(n_past=st.integers(1, 40), k=st.integers(1, 12), data=st.data())
def test_the_oracle_recalls_all_clues_that_there_is_room_for(observed, n_past, k, data):
    clues = set(data.draw(st.sets(st.integers(0, n_past - 1), max_size=8)))
    frame_numbers = set(numbers(observed(Oracle(k=k), n_past)(clues=tuple(sorted(clues)))))
    assert len(frame_numbers & clues) == min(k, len(clues))


def test_by_hand(observed):
    assert numbers(observed(Last(k=3), 9)()) == [6, 7, 8]
    assert numbers(observed(Uniform(k=3), 9)()) == [0, 3, 6]
    assert numbers(observed(Uniform(k=4), 10)()) == [0, 2, 5, 7]
    assert numbers(observed(Oracle(k=2), 9)(clues=(1, 4, 7))) == [1, 4]
    assert numbers(observed(Oracle(k=9), 9)(clues=(8,))) == list(range(9))


def test_draws_depend_on_seed_trajectory_and_question_alone(observed):
    def drawn(text="Where is it?", **about):
        return numbers(observed(Random(k=5), 30, **about)(text))

    assert drawn() == drawn()
    assert (
        len(
            {
                tuple(drawn()),
                tuple(drawn("What is it?")),
                tuple(drawn(seed=1)),
                tuple(drawn(name="u")),
            }
        )
        == 4
    )


def test_a_model_that_counts_no_tokens_gets_k_frames(observed):
    assert len(observed(Last(k=4), 9, tokens_per_frame=None)(budget=10)) == 4


def test_k_is_a_number_from_1():
    with pytest.raises(ValueError, match="k is 0; it is a number of frames from 1"):
        Last(k=0)
