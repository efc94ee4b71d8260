from collections import Counter

import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.question import Question
from model_adapters import check_bound, load
from model_adapters.bounds import Blind, Oracle, Random, question_type


def _question(text: str, *answers: str, kind: str | None = None, traj: str = "t") -> Question:
    return Question(traj, text, (0,), answers, kind)


KEY = [
    _question("Did you see a mug?", "yes", question_type="presence"),
    _question("Did you see a cup?", "no", question_type="presence"),
    _question("Did you see a pan?", "no", question_type="presence"),
    _question("What did you put on the desk?", "Mug", "Plate", question_type="put"),
    _question("How many plates are there?", "2"),
    _question("How many mugs are there?", "3"),
    _question("How MANY cups are there?", "3"),
]


def test_oracle_reads_the_key() -> None:
    oracle = Oracle()
    assert [oracle.answer(question) for question in KEY[:4]] == ["yes", "no", "no", "Mug, Plate"]


def test_type_is_the_files_or_the_leading_words() -> None:
    assert [question_type(question) for question in (KEY[0], KEY[6])] == ["presence", "how many"]


def test_blind_says_what_is_most_frequent_for_the_type() -> None:
    blind = Blind()
    blind.study(KEY)
    assert [blind.answer(question) for question in (KEY[0], KEY[3], KEY[4])] == ["no", "Mug, Plate", "3"]


def test_blind_breaks_ties_by_the_alphabet() -> None:
    blind = Blind()
    blind.study([_question("Is it?", "yes"), _question("Is it so?", "no")])
    assert blind.answer(_question("Is it now?", "yes")) == "no"


@pytest.mark.parametrize("bound", [Blind(), Random(0)])
def test_a_type_that_was_not_studied_is_an_error(bound: Blind | Random) -> None:
    bound.study(KEY)
    with pytest.raises(ModelError, match="why is"):
        bound.answer(_question("Why is it?", "so"))


def test_random_is_the_same_for_a_seed_and_differs_between_seeds() -> None:
    key = [_question(f"Is number {i} here?", "yes" if i % 2 else "no") for i in range(40)]

    def answers(seed: int, order: list[Question]) -> dict[str, str]:
        bound = Random(seed)
        bound.study(order)
        return {question.id: bound.answer(question) for question in order}

    assert answers(1, key) == answers(1, key[::-1])
    assert answers(1, key) != answers(2, key)


def test_random_draws_answers_as_often_as_they_occur() -> None:
    key = [_question(f"Is number {i} here?", "no" if i % 4 else "yes") for i in range(2000)]
    bound = Random(0)
    bound.study(key)
    drawn = Counter(map(bound.answer, key))
    assert set(drawn) == {"yes", "no"}
    assert 430 < drawn["yes"] < 570


@pytest.mark.parametrize("name", ["oracle", "blind", "random"])
def test_bounds_keep_their_contract(name: str) -> None:
    check_bound(load(name, {}, seed=3), KEY)  # type: ignore[arg-type]


def test_only_random_depends_on_the_seed() -> None:
    assert load("random", {}, 1).identity() != load("random", {}, 2).identity()
    assert load("blind", {}, 1).identity() == load("blind", {}, 2).identity()
