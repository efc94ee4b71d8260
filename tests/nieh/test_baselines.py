import json
from collections import Counter

import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.question import Question
from infthor_eval.nieh.baselines import BASELINES, Baseline, Blind, Oracle, Random, question_type
from model_adapters import names


def _question(text: str, *answers: str, kind: str | None = None, traj: str = "t") -> Question:
    return Question(traj, text, (0,), answers, kind)


KEY = [
    _question("Did you see a mug?", "yes", kind="presence"),
    _question("Did you see a cup?", "no", kind="presence"),
    _question("Did you see a pan?", "no", kind="presence"),
    _question("What did you put on the desk?", "Mug", "Plate", kind="put"),
    _question("How many plates are there?", "2"),
    _question("How many mugs are there?", "3"),
    _question("How MANY cups are there?", "3"),
]


def test_oracle_reads_the_key() -> None:
    predict = Oracle(0).fit(KEY)
    assert [predict(question) for question in KEY[:4]] == ["yes", "no", "no", "Mug, Plate"]


def test_type_is_the_files_or_the_leading_words() -> None:
    assert [question_type(question) for question in (KEY[0], KEY[6])] == ["presence", "how many"]


def test_blind_says_what_is_most_frequent_for_the_type() -> None:
    predict = Blind(0).fit(KEY)
    assert [predict(question) for question in (KEY[0], KEY[3], KEY[4])] == ["no", "Mug, Plate", "3"]


def test_blind_breaks_ties_by_the_alphabet() -> None:
    predict = Blind(0).fit([_question("Is it?", "yes"), _question("Is it so?", "no")])
    assert predict(_question("Is it now?", "yes")) == "no"


@pytest.mark.parametrize("baseline", [Blind(0), Random(0)])
def test_a_type_that_was_not_read_is_an_error(baseline: Blind | Random) -> None:
    predict = baseline.fit(KEY)
    with pytest.raises(ModelError, match="why is"):
        predict(_question("Why is it?", "so"))


def test_random_is_the_same_for_a_seed_and_differs_between_seeds() -> None:
    key = [_question(f"Is number {i} here?", "yes" if i % 2 else "no") for i in range(40)]

    def answers(seed: int, order: list[Question]) -> dict[str, str]:
        predict = Random(seed).fit(order)
        return {question.id: predict(question) for question in order}

    assert answers(1, key) == answers(1, key[::-1])
    assert answers(1, key) != answers(2, key)


def test_random_draws_answers_as_often_as_they_occur() -> None:
    key = [_question(f"Is number {i} here?", "no" if i % 4 else "yes") for i in range(2000)]
    drawn = Counter(map(Random(0).fit(key), key))
    assert set(drawn) == {"yes", "no"}
    assert 430 < drawn["yes"] < 570


@pytest.mark.parametrize("name", ["oracle", "blind", "random"])
def test_baselines_keep_their_contract(name: str) -> None:
    baseline = BASELINES[name](3)
    assert isinstance(baseline, Baseline)
    assert baseline.name == name
    identity = baseline.identity()
    assert json.loads(json.dumps(identity)) == identity == baseline.identity()
    predict = baseline.fit(KEY)
    there = [predict(question) for question in KEY]
    back = [predict(question) for question in reversed(KEY)][::-1]
    assert all(isinstance(answer, str) for answer in there)
    assert there == back


@pytest.mark.parametrize("name", ["blind", "random"])
def test_what_is_fitted_to_one_key_knows_nothing_of_another(name: str) -> None:
    baseline, other = BASELINES[name](0), [_question(f"Is {i}?", "yes", kind="presence") for i in range(9)]
    before = [predict(question) for predict in [baseline.fit(KEY)] for question in KEY]
    first, second = baseline.fit(KEY), baseline.fit(other)
    assert [first(question) for question in KEY] == before
    assert {second(question) for question in KEY[:3]} == {"yes"}


def test_only_random_depends_on_the_seed() -> None:
    assert BASELINES["random"](1).identity() != BASELINES["random"](2).identity()
    for name in ("blind", "oracle"):
        assert BASELINES[name](1).identity() == BASELINES[name](2).identity()


def test_no_model_has_the_name_of_a_baseline() -> None:
    assert set(BASELINES) == {"oracle", "blind", "random"}
    assert not set(BASELINES) & set(names())
