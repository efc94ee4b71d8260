"""The filter of cross-validation, against the scores in the published question files."""

import pytest

from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.nieh.validation import JudgedQuestion, Verdicts, judge_scores

from ..helpers.published import PUBLISHED_SETS, needs_published_sets


def filtered(file: str, *, partial_credit: bool) -> Verdicts:
    verdicts = Verdicts()
    for question in read_questions(PUBLISHED_SETS / file):
        right = judge_scores(dict(question.published.matches), partial_credit=partial_credit)
        verdicts.add(JudgedQuestion(question, {}, right))
    return verdicts


@needs_published_sets
@pytest.mark.parametrize(("partial_credit", "kept"), [(True, 829), (False, 809)])
def test_the_published_filter_keeps_every_published_question_with_one_clue(partial_credit, kept):
    verdicts = filtered("qa_set_nieh_single_clue.csv", partial_credit=partial_credit)
    assert len(verdicts.kept) == kept


@needs_published_sets
def test_of_those_with_several_clues_people_kept_four_that_no_model_answers():
    verdicts = filtered("qa_set_nsieh_multi_clue.csv", partial_credit=True)
    assert (len(verdicts.kept), len(verdicts.to_inspect), len(verdicts.rejected)) == (470, 4, 0)
    kept = Verdicts()
    for item in (*verdicts.kept, *verdicts.to_inspect):
        kept.add(JudgedQuestion(item.question, {}, item.right, "keep"))
    assert len(kept.kept) == 474
    assert len(filtered("qa_set_nsieh_multi_clue.csv", partial_credit=False).kept) == 465


def test_by_hand_a_part_of_the_marks_is_an_answer_where_that_is_asked_for():
    scores = {"all": 1.0, "half": 0.5, "none": 0.0}
    assert judge_scores(scores, partial_credit=False) == ("all",)
    assert judge_scores(scores, partial_credit=True) == ("all", "half")
