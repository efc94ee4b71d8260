"""Thoughts and answers of replies, in the markers of the families."""

import time

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


# Replies and what they answer: the marks that stand around an answer, in each state.
MARKED = {
    "a cup": "a cup",
    "<answer>a cup</answer>": "a cup",
    "<ANSWER >\n a cup \n</Answer >": "a cup",
    "<response>a cup</response>": "a cup",
    "So: <|begin_of_box|>a cup<|end_of_box|>.": "a cup",
    "Thus $\\boxed{a cup}$, as I said.\nBye": "a cup",
    "\\boxed {\\text{a cup}}": "a cup",
    "\\boxed{\\textbf{mug}, \\mathrm{plate}}": "mug, plate",
    # several, in each other, with braces, and with nothing in them
    "<answer>a mug</answer> No, <answer>a cup</answer>": "a cup",
    "<|begin_of_box|>a mug<|end_of_box|> or rather \\boxed{a cup}": "a cup",
    "<answer>\\boxed{a cup}</answer>": "a cup",
    "\\boxed{<answer>a cup</answer>}": "a cup",
    "<answer><answer>a cup</answer></answer>": "a cup",
    "\\boxed{{a} c{u{p}}}": "{a} c{u{p}}",
    '<|begin_of_box|>{"a": {"b": 1}}<|end_of_box|>': '{"a": {"b": 1}}',
    "I need no \\boxed{}.\n<answer>a cup</answer>": "a cup",
    "<answer>a cup</answer> <answer></answer>": "a cup",
    "<answer> </answer>": "",
    "\\boxed{}": "",
    # cut off, or begun by the prompt
    "<answer>a cup": "a cup",
    "<response> a cup": "a cup",
    "I saw it.\n<answer>\na cup": "a cup",
    "So: \\boxed{a cup": "a cup",
    "It is <|begin_of_box|>a cup": "a cup",
    "It is <answer>a cup</ans": "a cup",
    "<|begin_of_box|>a cup<|end_of": "a cup",
    "<answer>a cup</response>": "a cup",
    "a cup</answer>": "a cup",
    "a cup <|end_of_box|> ": "a cup",
    "<answer>": "",
}
# Words about marks, and what only looks like them.
UNMARKED = [
    "The tags <answer> and \\boxed are not needed: a cup",
    "I leave out \\boxed{} here: a cup",
    "in the <answer > box",
    "{a cup}",
    "a <cup>",
    "</answer> is what I was told to end with",
    " a cup\n",
]


@pytest.mark.parametrize(("text", "answer"), MARKED.items())
def test_marks_around_an_answer_are_taken_off_wherever_the_thoughts_are(text, answer):
    assert split_thinking(text) == (None, answer)
    assert split_thinking(f"<think>hm</think>\n{text}") == ("hm", answer)
    assert answer_of(Reply(text, thinking="hm")) == ("hm", answer)
    assert split_thinking(f"<think>{text}") == (text.strip(), "")


@pytest.mark.parametrize("text", UNMARKED)
def test_words_about_marks_are_the_answer_as_it_is(text):
    assert split_thinking(text) == (None, text)
    assert answer_of(Reply(text, thinking="")) == ("", text)


@given(st.lists(st.sampled_from([*MARKED, *UNMARKED, "<", "{", "}", "\\boxed{", "\n"]), max_size=6))
def test_any_marks_are_read_and_once_is_enough(texts):
    answer = split_thinking("".join(texts)).answer
    assert len(answer) <= len("".join(texts))
    if not set("<{}") & set(answer):
        assert split_thinking(answer).answer == answer


@pytest.mark.parametrize(
    "unit",
    ["<answer>", "</answer>", "\\boxed{", "\\boxed{{}", "<answer>\\boxed{", "<answer ", ". "],
)
def test_marks_without_end_are_read_in_time_that_grows_as_they_do(unit):
    times = []
    for n in (20_000, 80_000):
        start = time.process_time()
        split_thinking(unit * n)
        times.append(time.process_time() - start)
    assert times[1] < 8 * times[0] + 0.1


@given(PLAIN)
def test_a_text_without_markers_is_the_answer_as_it_is(text):
    assert split_thinking(text) == (None, text)


@given(thinking=PLAIN, answer=PLAIN)
def test_nothing_is_lost(thinking, answer):
    for before, behind in MARKERS.values():
        assert split_thinking(f"{before}{thinking}{behind}{answer}") == (
            thinking.strip(),
            answer.strip(),
        )


def test_what_a_server_tells_apart_is_taken_as_it_is():
    assert answer_of(Reply("a </think> cup", thinking="hm")) == ("hm", "a </think> cup")
