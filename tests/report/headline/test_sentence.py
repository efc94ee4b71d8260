"""The sentence of a page says what is so, whatever runs there are."""

import pytest

from infthor_eval.report.headline.sentence import headline

from .results import make_result


def said(*results):
    return headline(results).replace("\u00a0", " ")


def test_a_run_by_itself_has_its_interval():
    assert said(make_result("nano", 0.5)) == (
        "On nieh_gt nano gets 50.0 % (95 % interval 25.0 to 75.0) of the questions right and "
        "blind 25.0 %."
    )


def test_models_come_before_baselines_and_the_best_first():
    results = [make_result("blind", 0.3, is_baseline=True)]
    results += [make_result("low", 0.1), make_result("high", 0.9)]
    assert said(*results) == (
        "On nieh_gt high gets 90.0 % of the questions right, low 10.0 % and the baseline blind "
        "30.0 %."
    )


def test_baselines_alone_are_called_so():
    planner = make_result("planner", 1.0, is_baseline=True, chance=None)
    assert said(planner) == (
        "On nieh_gt the baseline planner gets 100.0 % (95 % interval 50.0 to 100.0) of the "
        "questions right."
    )


def test_blind_is_left_out_unless_it_is_known_of_all():
    results = [make_result("a", 0.5), make_result("b", 0.25, chance=None)]
    assert said(*results) == "On nieh_gt a gets 50.0 % of the questions right and b 25.0 %."


def test_a_task_that_blind_never_gets_right_comes_first():
    tasks = ("nieh_gt", "nieh_full", "nieh_twins")
    results = [
        make_result("a", 0.5, task=task, chance=0.0 if task == "nieh_twins" else 0.25)
        for task in tasks
    ]
    assert said(*results).startswith("On nieh_twins a gets")


def test_blind_on_different_questions_is_a_range():
    results = [make_result("a", 0.5), make_result("b", 0.25, chance=0.4)]
    assert "blind 25.0 to 40.0 %, by the questions answered" in said(*results)


def test_a_run_that_is_not_whole_says_over_how_many_its_score_is():
    text = said(make_result("nano (incomplete)", 0.5, n=30, n_all=40))
    assert "50.0 % (95 % interval 25.0 to 75.0; 30 of 40 answered)" in text


def test_a_run_in_which_nothing_was_answered_has_no_score():
    dead = make_result("dead (incomplete)", None)
    assert said(dead) == (
        "On nieh_gt dead (incomplete) has no score: none of 40 samples was answered."
    )
    assert said(make_result("a", 0.5, chance=None), dead).endswith(
        "of the questions right (dead (incomplete) has no score: none of 40 samples was answered)."
    )
    assert "4 runs have no score" in said(*[dead] * 4)


def test_of_many_runs_the_ends_are_named():
    results = [make_result(f"m{number}", number / 10) for number in range(6)]
    assert said(*results) == (
        "On nieh_gt m5 gets 50.0 % of the questions right, the highest of 6 runs, m0 0.0 %, the "
        "lowest, and blind 25.0 %."
    )


@pytest.mark.parametrize(
    ("scores", "start"),
    [
        ((0.5,) * 5, "each of 5 runs gets 50.0 %"),
        ((0.5, 0.5, 0.1, 0.2), "each of the best 2 runs gets 50.0 %"),
    ],
)
def test_runs_that_score_alike_are_not_told_apart(scores, start):
    results = [make_result(f"m{number}", score) for number, score in enumerate(scores)]
    assert start in said(*results)


def test_tasks_of_most_runs_come_first_and_suites_have_sentences_of_their_own():
    results = [make_result("a", 0.5, task=task, chance=None) for task in ("x", "y", "z")]
    results.append(make_result("b", 0.25, task="z", chance=None))
    plans = {"suite": "Plans", "task": "p", "finding": "completes {} of the plans"}
    results.append(make_result("a", 0.75, chance=None, **plans))
    text = said(*results)
    assert text.startswith("On z a gets 50.0 % of the questions right and b 25.0 %; on x a gets")
    assert "; 1 more task is in the table. On p a completes 75.0 %" in text


def test_no_runs_have_no_sentence():
    assert said() == ""
