"""Thoughts and answers of replies, in the markers of the families."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from model_adapters import Reply, answer_of
from model_adapters.thinking import MARKERS, split_thinking

PLAIN = st.text(st.characters(exclude_characters="<>[]◁▷|:"), max_size=40)


@pytest.mark.parametrize(("before", "behind"), MARKERS.values())
@pytest.mark.parametrize(("lead", "gap"), [("", ""), ("\n", "\n\n")])
def test_what_stands_between_the_markers_is_no_answer(before, behind, lead, gap):
    assert split_thinking(f"{lead}{before}{gap}A mug? No.{gap}{behind}{gap}a cup") == (
        "A mug? No.",
        "a cup",
    )
    assert split_thinking(f"{lead}{before}{gap}A mug? No, wait") == ("A mug? No, wait", "")
    assert split_thinking(f"{before}{behind}a cup") == ("", "a cup")


def test_the_first_marker_may_be_the_templates():
    assert split_thinking("A mug? No.</think>\n\na cup") == ("A mug? No.", "a cup")
    assert split_thinking("Here is my response: a cup") == (None, "Here is my response: a cup")


@pytest.mark.parametrize(
    "answer",
    [
        "a cup",
        "<answer>a cup</answer>",
        "So: <|begin_of_box|>a cup<|end_of_box|>",
        "<response> a cup",
    ],
)
def test_what_stands_around_an_answer_behind_thoughts_is_taken_off(answer):
    assert split_thinking(f"<think>hm</think>{answer}") == ("hm", "a cup")


@given(PLAIN)
def test_a_text_without_markers_is_the_answer_as_it_is(text):
    assert split_thinking(text) == (None, text)
    assert answer_of(Reply(f"<answer>{text}</answer>")) == (None, f"<answer>{text}</answer>")


@given(thinking=PLAIN, answer=PLAIN)
def test_nothing_is_lost(thinking, answer):
    for before, behind in MARKERS.values():
        assert split_thinking(f"{before}{thinking}{behind}{answer}") == (
            thinking.strip(),
            answer.strip(),
        )


def test_what_a_server_tells_apart_is_taken_as_it_is():
    assert answer_of(Reply("a </think> cup", thinking="hm")) == ("hm", "a </think> cup")
