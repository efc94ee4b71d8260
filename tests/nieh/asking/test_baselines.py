import json
from collections import Counter
from typing import Any

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.baselines import BASELINES, Baseline, Blind, Random
from infthor_eval.nieh.contexts import QuestionVariant
from model_adapters import names


def fit(baseline: Baseline, key: list[QuestionVariant], context: str = "trajectory") -> Any:
    data: Any = type("_Set", (), {"questions": [sample.question for sample in key]})
    return baseline.fit(data, context)


def make_sample(
    text: str, *answers: str, question_type: str | None = None, traj: str = "t", n_frames: int = 1
) -> QuestionVariant:
    return QuestionVariant(
        Question(traj, text, (0,), answers, question_type), tuple(range(n_frames))
    )


KEY = [
    make_sample("Did you see a mug?", "yes", question_type="presence"),
    make_sample("Did you see a cup?", "no", question_type="presence"),
    make_sample("Did you see a pan?", "no", question_type="presence"),
    make_sample("What did you put on the desk?", "Mug", "Plate", question_type="put"),
    make_sample("How many plates are there?", "2"),
    make_sample("How many mugs are there?", "3"),
    make_sample("How MANY cups are there?", "3"),
]


def predict_all(
    baseline: Baseline, key: list[QuestionVariant], context: str = "trajectory"
) -> list[str]:
    predict = fit(baseline, key, context)
    return [predict(sample) for sample in key]


# -- blind


def test_blind_on_one_trajectory_learns_from_the_other_questions() -> None:
    key = [make_sample(f"Is number {n} here?", "yes" if n == 1 else "no") for n in range(5)]
    assert predict_all(Blind(0), key) == ["no"] * 5
    assert predict_all(Blind(0), key[:1]) == [""]


def test_the_number_of_clue_frames_is_known_where_they_are_shown_alone() -> None:
    text = "How many times did you move the mug?"
    key = [
        QuestionVariant(Question(f"t{t}", text, tuple(range(n)), (str(n),)), (0,))
        for t in range(3)
        for n in (1, 2, 3)
    ]
    assert predict_all(Blind(0), key, "clues") == ["1", "2", "3"] * 3
    assert len(set(predict_all(Blind(0), key))) == 1


# -- random


def test_random_draws_no_answer_of_the_question_s_own_trajectory() -> None:
    key = [make_sample(f"Is {n} here?", f"{t} {n}", traj=f"t{t}") for t in range(3) for n in "ab"]
    key.append(make_sample("Why is it?", "so", traj="t0"))  # of its type there is no other
    for seed in range(20):
        *drawn, alone = predict_all(Random(seed), key)
        assert all(
            reply in {it.question.answers[0] for it in key[:-1]} and reply[0] != answer[0]
            for reply, answer in zip(drawn, (it.question.answers[0] for it in key), strict=False)
        )
        assert alone == ""


def test_random_on_one_trajectory_draws_no_answer_of_the_question_itself() -> None:
    key = [make_sample(f"Is {n} here?", str(n)) for n in range(8)]
    for seed in range(20):
        drawn = predict_all(Random(seed), key)
        assert all(reply != str(n) and reply in "01234567" for n, reply in enumerate(drawn))


def test_random_is_the_same_for_a_seed_and_differs_between_seeds() -> None:
    key = [make_sample(f"Is number {i} here?", "yes" if i % 2 else "no") for i in range(40)]

    def answers(seed: int, order: list[QuestionVariant]) -> dict[str, str]:
        predict = fit(Random(seed), order)
        return {sample.question.id: predict(sample) for sample in order}

    assert answers(1, key) == answers(1, key[::-1])
    assert answers(1, key) != answers(2, key)


def test_random_draws_answers_as_often_as_they_occur() -> None:
    key = [make_sample(f"Is number {i} here?", "no" if i % 4 else "yes") for i in range(2000)]
    drawn = Counter(predict_all(Random(0), key))
    assert set(drawn) == {"yes", "no"}
    assert 430 < drawn["yes"] < 570


# -- all of them


@pytest.mark.parametrize("name", BASELINES)
def test_baselines_keep_their_contract(name: str) -> None:
    baseline = BASELINES[name](3)
    assert isinstance(baseline, Baseline)
    assert baseline.name == name
    identity = baseline.identity()
    assert json.loads(json.dumps(identity)) == identity == baseline.identity()
    predict = fit(baseline, KEY)
    there = [predict(sample) for sample in KEY]
    back = [predict(sample) for sample in reversed(KEY)][::-1]
    assert all(isinstance(answer, str) for answer in there)
    assert there == back == predict_all(baseline, KEY[::-1])[::-1]


@pytest.mark.parametrize("name", ["blind", "random"])
def test_what_is_fitted_to_one_key_knows_nothing_of_another(name: str) -> None:
    baseline, other = (
        BASELINES[name](0),
        [make_sample(f"Is {i}?", "yes", question_type="presence") for i in range(9)],
    )
    before = predict_all(baseline, KEY)
    fit(baseline, other)
    assert predict_all(baseline, KEY) == before
    assert set(predict_all(baseline, other)) == {"yes"}


def test_only_random_depends_on_the_seed() -> None:
    assert BASELINES["random"](1).identity() != BASELINES["random"](2).identity()
    for name in ("blind", "oracle"):
        assert BASELINES[name](1).identity() == BASELINES[name](2).identity()


def test_no_model_has_the_name_of_a_baseline() -> None:
    assert set(BASELINES) == {"oracle", "blind", "random", "flip", "hash"}
    assert not set(BASELINES) & set(names())
