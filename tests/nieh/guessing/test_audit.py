"""The audit of a set, by hand and on the published files."""

import math
from dataclasses import replace

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.guessing.audit import BY, Audit, AuditedQuestion, Group, audit, chance_of
from infthor_eval.nieh.guessing.guessers import GUESSERS

from ...helpers.published import PUBLISHED_SETS, needs_published_sets
from ...helpers.questions import make_question

SINGLE, MULTI = "qa_set_nieh_single_clue", "qa_set_nsieh_multi_clue"
NAMES = [*(guesser.name for guesser in GUESSERS), "blind"]
PRESENCE, OPEN = "Is Mug on the Bed?", "Where is Mug now?"


def audited(text, answer, *scores, file="", clues=(1,), number=0):
    """A question with the scores of the first guessers; the others get 0."""
    right = (*scores, *[0.0] * (len(NAMES) - len(scores)))
    return AuditedQuestion(make_question(f"t{number}", text, answer, clues, file=file), right)


def sentences(questions):
    return list(Audit(NAMES, questions).sentences())


def test_a_group_tells_its_answers_and_its_best_guesser():
    answers = ("Yes", "yes", "no", "Bed")
    group = Group(
        "file",
        "all",
        NAMES,
        [audited(PRESENCE, answer, i < 1, i < 3, i < 3) for i, answer in enumerate(answers)],
    )
    assert group.answers == {"yes": 2, "no": 1, "bed": 1}
    assert group.entropy == pytest.approx(0.5 * 1 + 2 * 0.25 * 2)  # in bits: log2 of 2 and of 4
    assert group.share_yes == pytest.approx(2 / 3)
    assert group.means()[:4] == (0.25, 0.75, 0.75, 0.0)
    assert group.best() == (NAMES[1], 0.75)  # the simpler of two equals


def test_one_answer_has_no_entropy_and_open_questions_no_share_of_yes():
    group = Group("file", "all", NAMES, [audited(OPEN, "Bed")] * 3)
    assert (group.entropy, math.copysign(1, group.entropy), group.share_yes) == (0, 1, None)


def test_chance_of_a_list_has_its_partial_credit():
    lists = [("bed", "sofa"), ("bed", "desk"), ("bed", "desk"), ("cup", "safe")]
    questions = [
        replace(make_question(f"t{number}", "What did you open?"), answers=answers)
        for number, answers in enumerate(lists)
    ]
    # F1 of the answers on other trajectories: for the first 1/2 and 0; for each of the next two
    # 1/2, 1 and 0; for the last 0 and 0.
    assert chance_of(questions) == pytest.approx((0.25 + 0.5 + 0.5 + 0) / 4)


def test_chance_has_no_answer_of_the_own_trajectory_or_of_the_question_alone():
    def of(*key):
        return chance_of([make_question(traj, OPEN, answer, (n,)) for n, (traj, answer) in key])

    key = list(enumerate([("t", "a"), ("t", "a"), ("u", "b"), ("u", "a")]))
    # On t: b and a elsewhere. On u: a alone.
    assert of(*key) == pytest.approx((0.5 + 0.5 + 0 + 1) / 4)
    # On one trajectory the others of the four: for each a there are a and b, for b there is a.
    assert of(*((n, ("t", answer)) for n, (_, answer) in key)) == pytest.approx(1.5 / 4)
    assert of(*((n, ("t", str(n))) for n in range(8))) == 0
    assert of((0, ("t", "a"))) == 0


def test_groups_are_split_by_file_unless_they_are_files():
    items = [
        audited(PRESENCE, "yes", file="a"),
        audited(OPEN, "Bed", file="a", clues=(1, 2)),
        audited(PRESENCE, "no", file="b"),
    ]
    sizes = {
        by: {group.name: len(group.questions) for group in Audit(NAMES, items).groups(by)}
        for by in BY
    }
    assert sizes == {
        "file": {"a": 2, "b": 1},
        "answers": {"a: open-ended": 1, "a: yes/no": 1, "b: yes/no": 1},
        "clues": {"a: 1": 1, "a: 2": 1, "b: 1": 1},
        "type": {"a: final_state": 1, "a: location_tracing": 1, "b: final_state": 1},
        "form": {"a: Is {} in/on {}?": 1, "a: Where is {} now?": 1, "b: Is {} in/on {}?": 1},
    }
    (alone,) = Audit(NAMES, [audited("Why?", "x")]).groups("file")
    (untyped,) = Audit(NAMES, [audited("Why?", "x")]).groups("type")
    assert (alone.name, untyped.name) == ("all", "untyped")


def test_sentences_tell_what_is_striking():
    yes = [audited(PRESENCE, "yes", 1.0, number=i) for i in range(20)]
    places = [audited(OPEN, ("Bed", "Shelf")[i % 2], 0.0, i > 0, number=i) for i in range(20)]
    assert sentences([*yes, *places]) == [
        "All 20 yes/no questions of this set are yes.",
        "Is {} in/on {}? (20 questions): the answer is always yes.",
        f"Where is {{}} now? (20 questions): {NAMES[1]} gets 95.0 % without a frame.",
        "all: blind has 0.00 % without a frame.",
    ]
    # One question fewer is too few, and 90 % is not striking.
    assert len(sentences(yes[:19])) == 1
    assert len(sentences([*places[:19], audited(OPEN, "Bed")])) == 1
    both = [*yes[:19], audited(PRESENCE, "no")]
    assert not [sentence for sentence in sentences(both) if sentence.startswith("All")]


def test_a_set_is_audited_question_by_question(tmp_path):
    questions = [make_question(f"t{i}", PRESENCE, "yes" if i else "no") for i in range(4)]
    write_questions(tmp_path / "qa_set_test.csv", questions)
    audited_questions = audit(NiehSet(tmp_path)).questions
    assert [item.question for item in audited_questions] == questions
    assert [item.scores for item in audited_questions] == [
        (float(i > 0),) * len(NAMES) for i in range(4)
    ]


@needs_published_sets
def test_what_the_published_files_give_without_a_frame():
    published = audit(NiehSet(PUBLISHED_SETS))
    single, multi = published.groups("file")
    assert [(group.name, len(group.questions)) for group in (single, multi)] == [
        (SINGLE, 829),
        (MULTI, 474),
    ]
    at = {name: place for place, name in enumerate(NAMES)}
    for group, of_constant, of_words, of_blind in (
        (single, 63.33, 76.30, 75.69),
        (multi, 44.94, 65.90, 70.70),
    ):
        means = [round(100 * mean, 1) for mean in group.means()]
        assert means[at["one answer a file"]] == round(of_constant, 1)
        assert means[at["words"]] == pytest.approx(of_words, abs=0.1)
        assert means[at["blind"]] == pytest.approx(of_blind, abs=0.3)
        assert max(means) - means[at["blind"]] <= 2
        assert group.best()[1] == max(group.means())
    summary = list(published.sentences())
    assert summary[:2] == [
        f"All 525 yes/no questions of {SINGLE} are yes.",
        f"All 213 yes/no questions of {MULTI} are no.",
    ]
    assert f"{MULTI}: Is {{}} in/on {{}}? (213 questions): the answer is always no." in summary
