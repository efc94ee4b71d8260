"""Which number a person means who writes so: a table by hand, not by the code."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from word2number import w2n

from infthor_eval.nieh import score
from infthor_eval.nieh.numbers import number_in, number_of

MEANT = {
    0: [
        *("0", "0.0", "zero", "Zero.", "ZERO", "none", "None.", "None of them", "nothing", "nil"),
        *("Nothing was moved.", "no mugs", "No objects.", "There are no objects on it", "0 mugs"),
        *("never", "Never.", "I never moved it.", "zero times", "not one", "Not a single one."),
        *("There aren't any.", "There aren’t any mugs", "no visible objects", "-0"),
    ],
    1: [
        *("1", "one", "One.", "ONE", "one mug", "1 mug", "1.0", "(1)", "once", "Once.", "only one"),
        *("Just one.", "There was one.", "I moved it once.", "one of them", "exactly 1", "1 (one)"),
        *("One mug was on the table", "The answer is one", "there is only 1"),
    ],
    2: [
        *("2", "two", "Two.", "TWO", "(two)", "**two**", "*two*", "__two__", "_2_", "`2`", "'two'"),
        *('"Two"', "“two”", "[2]", "2.", "2!", "2?", "2.0", "2.00", "It is two.", "It's 2", "two."),
        *("two mugs", "2 mugs", "2 times", "Two times.", "twice", "Twice.", "I moved it 2 times."),
        *("two (2)", "2 (two)", "2 - two", "2 – two", "2 = two", "I think two", "Two, I think."),
        *("about 2", "maybe two", "~2", "There are 2.", "There were two mugs on the table."),
        *("Answer: 2", "answer: two", "The count is two", "a total of 2", "= 2", "2x", "No, 2."),
        *("Yes, two", "not 3 but 2", "２", "٢", "२", "$2$", "\\boxed{2}", "<b>2</b>", "2 items"),
        *("2\ufe0f\u20e3", " two\n", "two\u00a0", "two objects: a mug and a plate", "two or so"),
    ],
    3: [
        *("three", "3 mugs", "Three different objects.", "3.000", "3個", "three (3)", "- 3"),
        "• three",
    ],
    4: ["4", "4.0", "four", "Four objects", "four!"],
    5: ["five", "5", "five times", "5 objects in total"],
    6: ["six", "half a dozen", "Half a dozen.", "6.0 times"],
    7: ["Seven, I think.", "seven", "I counted seven", "7 or so"],
    10: ["10", "ten", "Ten of them.", "10 objects", "ten mugs", "010"],
    12: ["twelve", "a dozen", "A dozen.", "one dozen", "a dozen mugs", "12"],
    20: ["twenty", "20", "twenty mugs"],
    21: ["twenty one", "twenty-one", "Twenty-One.", "twenty one mugs", "the twenty one mugs"],
    23: [
        *("Twenty three.", "twenty-three", "TWENTY-THREE!", "twenty\u2011three", "twenty  three"),
        *("twenty three mugs", "23"),
    ],
    24: ["two dozen", "twenty four"],
    40: ["forty", "Forty."],
    99: ["ninety-nine", "ninety nine"],
    100: ["a hundred", "one hundred", "hundred", "100", "100.0", "a hundred mugs", "1e2"],
    105: ["a hundred and five", "one hundred five"],
    123: ["one hundred twenty three", "one hundred and twenty-three", "a hundred and twenty three"],
    1_000: ["1,000", "1000", "a thousand", "one thousand", "1e3", "1E3", "1,000.0", "1'000"],
    1_001: ["one thousand and one", "1,001", "a thousand and one"],
    1_234: ["1,234", "one thousand, two hundred and thirty-four", "1\u202f234", "1234"],
    1_000_000: ["1,000,000", "a million", "one million", "1 000 000"],
    3_000_000: ["three million"],
    0.5: ["0.5", ".5", "0.50"],
    2.5: ["2.5"],
    -3: ["-3", "minus three", "negative 3", "\u22123", "minus 3"],
}
NO_NUMBER = [
    # Several, or between two.
    *("1-2", "2-3", "2–3", "2 to 3", "2/3", "1/2", "10:30", "3:00", "two or three", "2 or 3"),
    *("2,3", "one or two", "between 2 and 3", "once or twice", "3 out of 5", "two of the three"),
    *("2, 3", "1 mug and 2 plates", "two mugs, three plates", "one two three", "two and three"),
    *("2,5", "2x4", "1.2.3", "1.000.000", "2024-05-01", "2 hours 30 minutes", "two; three"),
    "six seven",
    # A thing, not how many.
    *("the one on the table", "that one", "the red one", "which one", "this one", "another one"),
    *("no one", "the last one", "The other one.", "a red one", "someone", "FloorPlan12", "mug2"),
    *("3-legged stool", "a two-door fridge", "one-handed", "cabinet-2"),
    *("stone", "phone", "money", "often", "tenth", "weight", "freight", "network", "attention"),
    # The place in an order, a share.
    *("2nd", "second", "the second", "1st", "23rd", "21st", "twenty first", "twenty-first"),
    *("third", "two thirds", "one half", "half", "two and a half", "2½", "½", "10%", "50 %"),
    *("2²", "Ⅲ", "III"),
    # A bound, or what it is not.
    *("at least two", "more than 3", "less than 3", "no more than two", "over 10", "up to 5", "3+"),
    *("3 or more", "two or more", "At most 4.", "not two", "It isn't 3", "not 2"),
    "fewer than five",
    # Nothing definite.
    *("several", "a few", "many", "some", "a couple", "dozens", "hundreds of mugs", "", "?", "-"),
    *("yes", "no", "No.", "no idea", "No, I have no clue.", "I don't know", "unknown", "mug"),
    *("...", "No, there was a mug", "no answer", "5k"),
]


@pytest.mark.parametrize("number", MEANT, ids=str)
def test_a_spelling_is_the_number_that_a_person_means(number):
    wrong = {text: number_in(text) for text in MEANT[number] if number_in(text) != number}
    assert wrong == {}
    assert [text for text in MEANT[number] if score(text, [number], "strict") != 1.0] == []
    others = [other for other in MEANT if other != number]
    assert not any(score(text, [gold], "strict") for text in MEANT[number] for gold in others)


def test_what_is_no_number_or_several_is_none():
    assert {text: number_in(text) for text in NO_NUMBER if number_in(text) is not None} == {}
    assert not any(score(text, [gold], "strict") for text in NO_NUMBER for gold in MEANT)
    assert sum(map(len, MEANT.values())) + len(NO_NUMBER) >= 200


NAMES = list(w2n.american_number_system)  # zero to nineteen, twenty to ninety


def spell(number, hyphen, link):
    """A number in words: "two thousand one hundred and twenty-three"."""
    for unit, name in ((1000, "thousand"), (100, "hundred")):
        if number >= unit:
            rest = f"{link}{spell(number % unit, hyphen, link)}" if number % unit else ""
            return f"{spell(number // unit, hyphen, link)} {name}{rest}"
    if number < 20:
        return NAMES[number]
    rest = f"{hyphen}{NAMES[number % 10]}" if number % 10 else ""
    return NAMES[18 + number // 10] + rest


around = st.sampled_from(
    ["{}", "{}.", "**{}**", "({})", "It is {}.", "There were {} mugs.", "_{}_"]
)


@given(st.integers(1, 99_999), st.sampled_from("- "), st.sampled_from([" ", " and "]), around)
def test_a_number_is_read_in_words_and_in_figures_whatever_stands_around_it(
    number, hyphen, link, around
):
    for said in (spell(number, hyphen, link), str(number), f"{number:,}", f"{number}.0"):
        assert number_in(around.format(said)) == number
        assert number_of(said) == number
        assert score(around.format(said), [number + 1], "strict") == 0.0


@given(
    st.integers(0, 50), st.integers(0, 50), st.sampled_from([" or ", "-", ", ", "/", ":", " to "])
)
def test_two_numbers_are_none(one, other, between):
    said = f"{one}{between}{other}"
    assert number_in(said) == (one if one == other else None)


@given(st.text(max_size=40))
def test_any_text_is_read(text):
    assert number_in(text) is None or number_in(f" {text}\n") == number_in(text)
    assert number_of(text) in (None, number_in(text))


@pytest.mark.parametrize(
    ("gold", "number"),
    [
        *[("4.0", 4), (4.0, 4), ("Two", 2), ("three mugs", 3), ("1,000", 1000), ("-3", -3)],
        *[("none", 0), ("Shelf 2", None), ("the one on the table", None), ("10:30", None)],
        *[("2/3", None), ("one of the drawers", None), ("box", None), ("", None)],
        (float("nan"), None),
    ],
)
def test_a_gold_answer_is_a_number_if_it_is_nothing_else(gold, number):
    assert number_of(gold) == number


@pytest.mark.parametrize(
    ("reply", "gold", "right"),
    [
        *[("4", "4.0", 1), ("40", "4.0", 0), ("four", "4.0", 1), ("5", "0.5", 0), ("0.5", 0.5, 1)],
        *[("12", "1-2", 0), ("1-2", "1-2", 1), ("23", "2/3", 0), ("2/3", "2/3", 1)],
        *[("1030", "10:30", 0), ("10:30", "10:30", 1), ("shelf 1", "shelf 2", 0)],
    ],
)
def test_marks_inside_numbers_stay(reply, gold, right):
    assert score(reply, [gold], "strict") == right
