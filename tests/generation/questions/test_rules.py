"""The rules on a replayed trajectory, judged by the checker and by the scorers."""

from collections import Counter, defaultdict
from dataclasses import replace

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import Step, read_steps
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.history import DEFAULT_SHARE, History
from infthor_eval.generation.questions.make import make_questions
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.nieh.scoring import score
from infthor_eval.thor.launch import embedded
from infthor_eval.thor.simulator import Simulator

QUESTION_TYPES = {
    "object_presence",
    "open_state",
    "location_tracing",
    "slicing",
    "container_content",
    "put_action",
    "final_state",
    "movement_counting",
}


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    jobs = [TrajectorySettings(scene, 3, 110, 1) for scene in ("kitchen-3", "kitchen-5")]
    with Simulator(embedded()) as simulator:
        generate_set(jobs, simulator, folder / "trajectories")
        assert summarise(replay_set(select([folder / "trajectories"]), simulator, folder)).complete == 2
    return folder


@pytest.fixture(scope="module")
def everything(replayed):
    return make_questions(replayed, per_trajectory=1000)


def test_the_checker_agrees_with_every_question(everything):
    assert not everything.doubted and not everything.skipped
    assert {question.question_type for question in everything.questions} == QUESTION_TYPES
    assert all(everything.by_clues().values())


def test_gold_answers_score_full_marks(everything):
    for question in everything.questions:
        said = ", ".join(str(answer) for answer in question.answers)
        for scorer in ("reference", "strict"):
            assert score(said, question.answers, scorer=scorer) == 1.0, (question.text, question.answers)


def test_the_checker_notices_what_is_wrong(everything, replayed):
    checkers = {folder.name: Checker(read_steps(folder), DEFAULT_SHARE) for folder in (replayed / "metadata").iterdir()}
    presence = [question for question in everything.questions if question.question_type != "object_presence"]
    for question in presence:
        checker = checkers[question.traj_id]
        assert not checker.verdict(replace(question, answers=("teapot",))).right
        first = 0 if 0 not in question.clues else 1
        assert not checker.verdict(replace(question, clues=(first, *question.clues))).sound
        if len(question.clues) > 1:
            assert not checker.verdict(replace(question, clues=question.clues[1:])).sufficient


def test_choice_is_balanced_and_seeded(replayed):
    made = [make_questions(replayed, seed=seed, per_trajectory=25) for seed in (0, 0, 1)]
    assert made[0].questions == made[1].questions != made[2].questions
    assert len(made[0].questions) <= 50
    yes = [question for question in made[0].questions if question.answers == ("yes",)]
    no = [question for question in made[0].questions if question.answers == ("no",)]
    assert abs(len(yes) - len(no)) <= 5
    assert set(made[0].by_type()) == QUESTION_TYPES


def test_absences_are_flagged_and_look_like_presences(everything):
    presence = [question for question in everything.questions if question.question_type == "object_presence"]
    assert {question.absence for question in presence} == {True, False}
    for question in everything.questions:
        assert question.absence == (question.question_type == "object_presence" and question.answers == ("no",))
    assert {len(question.clues) for question in presence} == {1}


def test_no_answer_follows_from_the_form_of_a_question(replayed):
    made = make_questions(replayed, per_trajectory=60)
    answers = defaultdict(Counter)
    for question in made.questions:
        if str(question.answers[0]) in {"yes", "no"} or str(question.answers[0]).isdecimal():
            answers[_form(question.text)][question.answers[0]] += 1
    assert len(answers) > 4
    for form, counts in answers.items():
        most = counts.most_common(1)[0][1]
        assert most <= counts.total() - most + 1, (form, counts)


def _form(text):
    words = text.split()
    return " ".join(words[:5]) if words[0] == "How" else f"{words[0]} ... {text[-9:] if 'open now' in text else ''}"


def test_texts_are_english(everything):
    for question in everything.questions:
        assert question.text[0].isupper() and question.text.endswith("?")
        for wrong in (" a apple", " a egg", " an mug", "  ", " a bread"):
            assert wrong not in question.text


def test_no_answer_is_in_its_question(everything):
    for question in everything.questions:
        if question.answers[0] not in {"yes", "no"}:
            words = question.text.lower().replace(" ", "")
            assert not [answer for answer in question.answers if len(answer) > 2 and answer in words], question


def test_a_log_without_what_frames_show_is_skipped(replayed, tmp_path):
    with pytest.raises(DataError, match="does not say what the frames show"):
        History("t", [Step(0, "0.png")])
    with pytest.raises(DataError, match="no trajectory there"):
        make_questions(tmp_path)
