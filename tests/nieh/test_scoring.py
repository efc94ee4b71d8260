import gzip
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import UsageError
from infthor_eval.nieh import score
from infthor_eval.nieh.scoring import scores

GOLDENS = Path(__file__).parents[1] / "goldens"
names = st.from_regex(r"[a-z]{3,9}( [a-z]{3,9})?", fullmatch=True).filter(
    lambda name: "and" not in name.split()
)
answers = st.lists(names, min_size=1, max_size=5)


@pytest.mark.parametrize("name", ["scorer_pairs", "scorer_adversarial_pairs"])
def test_reference_equals_the_published_scorer_on_every_golden_pair(name):
    with gzip.open(GOLDENS / f"{name}.jsonl.gz", "rt") as file:
        pairs = [json.loads(line) for line in file]
    wrong = [pair for pair in pairs if score(pair["response"], pair["answers"]) != pair["score"]]
    assert len(pairs) >= 4000
    assert wrong == []


# The published scorer's rules, one by one.
EXACT = {
    "numbers": [
        ("3", [3], 1),
        ("three", ["3"], 1),
        ("twenty one", ["21"], 1),
        ("two mugs", ["2"], 1),
        ("3 mugs", ["3"], 0),
        ("1", [1.0], 0),
        ("thousand one", ["thousand one"], 1),
    ],
    "leading phrase": [
        ("It is mug", ["mug"], 1),
        ("  it  is\tmug", ["mug"], 1),
        (" - It is mug", ["mug"], 1),
        ("It is\u00a0mug", ["mug"], 1),
        ("CD is  - plate", ["plate"], 1),
        ("mug", ["It is mug"], 1),
        ("x is y is mug", ["mug"], 0),
        ("the object is mug", ["mug"], 0),
        ("It ismug", ["mug"], 0),
        ("it was mug", ["mug"], 0),
    ],
    "nothing": [("", ["-"], 1), ("-", ["?"], 1), ("", ["mug"], 0)],
    "nearly": [("teddy bear", ["teddybear"], 1), ("Mugs!", ["mug"], 1), ("pan", ["pen"], 0)],
    "synonyms": [
        ("top shelf", ["to the shelf"], 1),
        ("couch", ["loveseat"], 1),
        ("marker", ["pencil"], 1),
        ("stick", ["baseballbat"], 1),
        ("the counter", ["countertop"], 0),
    ],
    "yes and no": [
        ("'yes", ["yes"], 1),
        ("- yes, it was", ["yes"], 1),
        ("yes no", ["no"], 0),
        ("oh yes", ["yes"], 0),
        ("Nope", ["no"], 1),
        ("un no", ["no"], 0),
    ],
    "several": [
        ("plate, mug", ["mug", "plate"], 1),
        ("mug, and plate", ["mug", "plate"], 1),
        ("mug; plate", ["mug", "plate"], 0),
        ("candle, sand", ["candle", "s"], 0.5),
        ("mug,,", ["mug", ""], 1.5),
        ("yes, 2", ["yes", 2], 1),
        ("mug, plate", ["mug"], 0),
    ],
}


@pytest.mark.parametrize("rule", EXACT)
def test_reference_keeps_each_rule_of_the_published_scorer(rule):
    assert [(reply, gold, score(reply, gold)) for reply, gold, _ in EXACT[rule]] == EXACT[rule]


@pytest.mark.parametrize(
    ("response", "gold", "reference", "strict"),
    [
        ("mug, mug, mug", ["mug", "plate"], 1.5, 0.4),
        ("candle, hand towel", ["candle", "hand towel"], 0.5, 1.0),
        ("not sure", ["no"], 1.0, 0.0),
        ("none", ["no"], 1.0, 0.0),
        ("notebook", ["no"], 1.0, 0.0),
        ("yesterday", ["yes"], 1.0, 0.0),
        ("yes and no", ["yes"], 1.0, 0.0),
        ("No, it is not.", ["no"], 1.0, 1.0),
        ("100", ["10"], 1.0, 0.0),
        ("three", ["3"], 1.0, 1.0),
        ("three", [3], 1.0, 1.0),
        ("refrigerator", ["Fridge"], 1.0, 1.0),
        ("It is Sofa.", ["sofa"], 1.0, 1.0),
        ("mug and plate", ["mug", "plate"], 0.0, 1.0),
        ("", ["mug"], 0.0, 0.0),
        ("", ["mug", "cup"], 0.0, 0.0),
        ("mug, mug", ["mug", "mug"], 2.0, 1.0),
        ("mug", ["mug", "plate"], 0.5, 2 / 3),
        ("mug, plate, cup, pan, pot, fork, bowl", ["mug", "plate"], 1.0, 4 / 9),
        ("mug, plate", ["mug"], 0.0, 0.0),
        ("lettuce slice", ["lettucesliced"], 1.0, 1.0),
        ("sliced lettuce", ["LettuceSliced"], 0.0, 1.0),
        ("a slice of lettuce", ["lettuce slice"], 0.0, 1.0),
        ("lettuce", ["lettuce slice"], 0.0, 1.0),
        ("bread slices, knife", ["bread", "knife"], 0.5, 1.0),
        ("slice", ["bread slice"], 0.0, 0.0),
        ("sliced tomato", ["potato"], 0.0, 0.0),
    ],
)
def test_known_faults_stay_in_reference_and_are_mended_in_strict(response, gold, reference, strict):
    assert score(response, gold, "reference") == reference
    assert score(response, gold, scorer="strict") == strict


@given(st.text(max_size=60), answers)
def test_strict_stays_within_zero_and_one(response, gold):
    assert 0.0 <= score(response, gold, "strict") <= 1.0


@given(answers.filter(lambda gold: len(gold) > 1), names)
def test_one_answer_more_than_there_are_costs_something(gold, more):
    assert score(", ".join([*gold, more]), gold, "strict") < 1.0


@given(st.lists(names, max_size=5), answers, names)
def test_a_wrong_answer_more_never_gains(replied, gold, wrong):
    if score(wrong, [gold[0]], "strict") or any(score(wrong, [item], "strict") for item in gold):
        return
    assert score(", ".join([*replied, wrong]), gold, "strict") <= score(
        ", ".join(replied), gold, "strict"
    )


@given(answers, st.randoms())
def test_strict_does_not_depend_on_the_order_of_the_answers(gold, random):
    replied = list(gold)
    random.shuffle(replied)
    assert score(", ".join(replied), gold, "strict") == 1.0


@given(st.text(max_size=40))
def test_reference_takes_any_response(response):
    for gold in (["mug"], ["yes"], [3], ["mug", "no"]):
        assert score(response, gold) >= 0.0


def test_the_last_line_of_a_reply_counts():
    assert scores("I think so.\nyes", ["yes"]) == {"reference": 1.0, "strict": 1.0}
    assert scores("yes\nI think so.", ["yes"]) == {"reference": 0.0, "strict": 0.0}


FORMS = [
    *("{}, ", "{}; ", "{} and ", "{}/", "{} & ", "{}，", "{}、", "{}\n", "- {}\n", "* {}\n"),
    *("1. {}\n", "{}.\n", "{}\n\n", "2) {}, ", "**{}**\r\n"),
]


@given(
    answers, st.sampled_from(FORMS), st.sampled_from(["", "I looked at it all.\n", "They are:\n\n"])
)
def test_strict_reads_a_list_in_any_form(gold, form, before):
    reply = before + "".join(form.format(name) for name in gold).rstrip(",; &/，、\n")
    reply = reply.removesuffix(" and")
    if len(gold) > 1:
        assert scores(reply, gold)["strict"] == 1.0
    assert scores(reply, gold)["reference"] == score(reply.strip().split("\n")[-1].strip(), gold)


@pytest.mark.parametrize(
    ("reply", "gold", "strict"),
    [
        ("Let me look. I see it now.\nmug, plate", ["mug", "plate"], 1.0),
        ("mug\nplate\nThese are the objects.", ["mug", "plate"], 0.8),
        ("mug\nplate", ["plate"], 1.0),  # of one answer the last line alone counts
        ("cup\nI was wrong!\nmug\nplate", ["mug", "plate"], 1.0),
        ("salt and pepper, mug", ["salt and pepper", "mug"], 1.0),
        ("mug / TV/monitor", ["TV/monitor", "mug"], 1.0),
        ("1,000 and 5", [1000, 5], 1.0),
        ("2/3", [2, 3], 1.0),
        ("", ["mug", "plate"], 0.0),
        ("\n\n", ["mug", "plate"], 0.0),
    ],
)
def test_lines_and_marks_of_lists(reply, gold, strict):
    assert scores(reply, gold)["strict"] == strict
    assert score(reply, gold, "strict") == strict


def test_unknown_scorer_and_empty_gold_are_refused():
    with pytest.raises(UsageError, match="unknown scorer 'lenient'"):
        score("mug", ["mug"], "lenient")
    with pytest.raises(UsageError, match="empty list"):
        score("mug", [])
