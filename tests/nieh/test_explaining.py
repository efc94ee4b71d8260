"""The reasons that are given for a score are those of the scorers."""

import pytest

from infthor_eval.nieh.explaining import explain
from infthor_eval.nieh.scoring import SCORERS, score

PAIRS = [
    ("mug", ("mug",)),
    ("The Mug.", ("mug",)),
    ("mugs", ("mug",)),
    ("a bowl", ("bowl",)),
    ("couch", ("sofa",)),
    ("the answer is\nplate", ("plate",)),
    ("100", (10,)),
    ("ten", (10,)),
    ("not sure", ("no",)),
    ("No, it is not", ("no",)),
    ("yes and no", ("yes",)),
    ("yesterday", ("yes",)),
    ("sliced lettuce", ("lettuce",)),
    ("the one on the table", ("table",)),
    ("mug; plate", ("mug", "plate")),
    ("mug, mug and cup", ("mug", "plate")),
    ("", ("mug",)),
    ("", ("mug", "plate")),
]


@pytest.mark.parametrize(("reply", "answers"), PAIRS)
@pytest.mark.parametrize("scorer", SCORERS)
def test_a_gold_answer_is_said_where_it_scores(reply, answers, scorer):
    lines = explain(reply, answers, [scorer])
    golds = [line for line in lines if line.startswith("  ")]
    last = reply.splitlines()[-1] if reply else ""
    assert f"{scorer}: {score(last, answers, scorer):g}" in " ".join(lines)
    assert len(golds) == len(answers)
    is_said = any(" is said by " in line for line in golds)
    assert is_said == (score(last, answers, scorer) > 0)


@pytest.mark.parametrize(
    ("reply", "answers", "reason"),
    [
        ("mugs", ("mug",), "'mugs' and 'mug' are 86 % alike, 80 % are enough"),
        ("the mug", ("mug",), "'the mug' and 'mug' are 60 % alike, 80 % are needed"),
        ("couch", ("sofa",), "'couch' and 'sofa' are in one row of synonyms"),
        ("100", (10,), "the number must be 10"),
        ("not sure", ("no",), "the first word must be no"),
        ("sliced lettuce", ("lettuce",), "equal as 'lettuce'"),
        ("think\nmug", ("mug",), "the last line counts: 'mug'"),
        ("They are:\nmug\nplate", ("mug", "plate"), "the list counts: 'mug\\nplate'"),
        ("shelf 1", ("shelf 2",), "86 % alike, but their figures differ"),
    ],
)
def test_the_reason_is_said_in_words(reply, answers, reason):
    assert reason in "\n".join(explain(reply, answers, ["strict"]))
