"""Balanced parts of sets."""

from infthor_eval.formats.question import Question
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.balancing import MARGIN, _best_cut, balance
from infthor_eval.nieh.guessing.forms import form_of
from infthor_eval.nieh.guessing.guesses import score_guesses


def questions_of(answers):
    """One question of a form per answer, on ten trajectories, each on an object of its own."""
    return [
        Question(f"t{n % 10}", f"Have you seen the {chr(97 + n % 26)}{n}?", (1,), (answer,))
        for n, answer in enumerate(answers)
    ]


def is_balanced(questions):
    """Whether no guesser is more than the margin above chance in a form, counted afresh."""
    scores = score_guesses(questions)
    for form in {form_of(item) for item in questions}:
        of_form = [(item, own) for item, own in zip(questions, scores, strict=True) if form_of(item) == form]
        chance = 1 / len({doc_target(item) for item, _ in of_form})
        means = [sum(column) / len(of_form) for column in zip(*(own for _, own in of_form), strict=True)]
        if max(means) > chance + MARGIN:
            return False
    return True


def test_what_the_words_give_away_goes():
    """A third of the questions has its answer in its words."""
    leaking = [
        Question(
            f"t{n % 10}", f"Is there any {'mug' if n % 2 else 'book'} in this room?", (1,), (("yes", "no")[n % 2],)
        )
        for n in range(30)
    ]
    fair = questions_of(["yes", "no", "no", "yes"] * 15)
    part = balance([*leaking, *fair])
    assert is_balanced(part.questions)
    kept = {form: kept for form, (kept, _) in part.kept.items()}
    assert kept["Is there any {} in this room?"] < 10
    assert kept["Have you seen {}?"] > 20
    assert part.best_score <= part.chance + MARGIN


def test_one_answer_alone_leaves_nothing():
    part = balance(questions_of(["yes"] * 12))
    assert (list(part.questions), part.kept) == ([], {"Have you seen {}?": (0, 12)})


def test_a_question_that_is_there_twice_is_kept_once():
    questions = questions_of(["yes", "no"] * 10)
    part = balance([*questions, *questions])
    assert len({question.id for question in part.questions}) == len(part.questions)


def test_the_cut_keeps_most_within_chance_and_margin():
    assert _best_cut([10, 10]) == (2, 10)
    assert _best_cut([30, 10]) == (2, 11)  # 11 of 21 are 52 %, at most 53
    assert _best_cut([5]) == (0, 0)
    n_answers, most = _best_cut([9, 8, 7, 1])
    assert (n_answers, most) == (3, 8)  # 23 questions, of which 8 are 35 %, at most 36
