"""The rules on a replayed trajectory, judged by the checker and by the scorers."""

import json
import re
import shutil
from collections import Counter, defaultdict
from dataclasses import replace

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import Step, read_steps
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import generate_questions
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.wording import with_the
from infthor_eval.nieh.scoring import score

FURTHER_TYPES = {
    "container_content_further",
    "location_tracing_further",
    "movement_counting_further",
    "open_state_further",
    "put_action_further",
}
CLOSED = (
    r"Is there any .+ in this room\?",
    r"Have you seen .+\?",
    r"Was the .+ open\?",
    r"Was the .+ open when you .+\?",
    r"Is the .+ open now\?",
    r"Is the .+ (in|on) the .+\?",
)
# Of what is the only one of its type and never changes; `test_readings` has some.
RARE = {"container_content"}
TABLE_3 = {
    "object_presence": (r"Is there any .+ in this room\?", r"Have you seen .+\?"),
    "open_state": (r"Was the .+ open\?",),
    "location_tracing": (
        r"Where was the .+ before you put it (in|on) the .+\?",
        r"Where did you move the .+ from the .+\?",
        r"Where is the .+ now\?",
    ),
    "slicing": (
        r"What did you slice\?",
        r"What objects were (in|on) the .+ when you sliced the .+\?",
    ),
    "container_content": (r"What objects were (in|on) the .+\?",),
    "put_action": (r"What object did you put (in|on) the .+\?",),
    "final_state": (
        r"Is the .+ (in|on) the .+\?",
        r"What objects are (in|on) the .+\?",
        r"How many objects were (in|on) the .+\?",
    ),
    "movement_counting": (r"How many times did you move the .+\?",),
}
QUESTION_TYPES = TABLE_3.keys()


def of_types(generated, *types):
    """The questions of some types."""
    return [question for question in generated.questions if question.question_type in types]


@pytest.fixture(scope="module")
def replayed(tmp_path_factory, simulator):
    folder = tmp_path_factory.mktemp("set")
    jobs = [
        TrajectorySettings(f"kitchen-{number}", seed, 110, 1)
        for number, seed in ((2, 2), (3, 4), (5, 4))
    ]
    generate_set(jobs, simulator, folder / "trajectories")
    replayed = replay_set(select([folder / "trajectories"]), simulator, folder)
    assert summarise(replayed).complete == len(jobs)
    return folder


@pytest.fixture(scope="module")
def logs(replayed):
    """The steps of each trajectory by its name."""
    return {folder.name: read_steps(folder) for folder in (replayed / "metadata").iterdir()}


@pytest.fixture(scope="module")
def everything(replayed):
    return generate_questions(replayed, per_trajectory=1000, further=True, by_subject=False)


def test_the_checker_agrees_with_every_question(everything):
    assert not everything.unconfirmed and not everything.skipped
    assert {question.question_type for question in everything.questions} >= (
        QUESTION_TYPES | FURTHER_TYPES
    ) - RARE
    assert all(everything.by_clues().values())


def test_without_further_forms_all_are_in_the_words_of_table_3(replayed, everything):
    questions = generate_questions(replayed, per_trajectory=1000, by_subject=False).questions
    types = {question.question_type for question in questions}
    assert QUESTION_TYPES - RARE <= types <= QUESTION_TYPES
    for question in questions:
        forms = TABLE_3[question.question_type]
        assert any(re.fullmatch(form, question.text) for form in forms), question
    every = "|".join(form for forms in TABLE_3.values() for form in forms)
    for question in of_types(everything, *FURTHER_TYPES):
        assert not re.fullmatch(every, question.text), question


def test_a_put_has_two_clues_that_follow_each_other(everything):
    puts = [question.clues for question in of_types(everything, "put_action")]
    assert puts and all(len(clues) == 2 and clues[1] == clues[0] + 1 for clues in puts)


def test_what_was_moved_once_is_not_counted(everything):
    counted = of_types(everything, "movement_counting")
    assert counted and all(
        int(question.answers[0]) == len(question.clues) > 1 for question in counted
    )


def test_the_number_of_frames_tells_nothing_about_further_counts(everything):
    counted = of_types(everything, "movement_counting_further")
    usual = [question for question in counted if len(question.clues) == 16]
    assert len({question.answers for question in usual}) > 2
    for question in counted:
        # Two frames show an opening or a put, one that an object is held.
        count = int(question.answers[0])
        n_clues = len(question.clues) / (1 if "different" in question.text else 2)
        assert n_clues == 8 or (n_clues % 8 == 0 and count >= n_clues / 2), question
        assert count < n_clues


def test_what_was_put_is_in_the_hand_in_the_frame_before(everything, logs):
    puts = [
        question
        for question in everything.questions
        if question.question_type == "put_action_further" or "you put" in question.text
    ]
    n_shown = 0
    for question in puts:
        if question.question_type == "location_tracing":
            continue  # the question itself says that it was put
        steps = logs[question.traj_id]
        for clue in question.clues:
            if (steps[clue].action or "").startswith("PutObject"):
                assert clue - 1 in question.clues and steps[clue - 1].object_log.inven_obj
                n_shown += 1
    assert n_shown > 10


def test_a_frame_shows_the_moment_that_a_question_asks_about(everything, logs):
    verbs = {"first opened": "OpenObject", "picked up": "PickupObject", "put": "PutObject"}
    verbs |= {"sliced": "SliceObject", "turned on": "ToggleObjectOn"}
    further = of_types(everything, *FURTHER_TYPES)
    questions = [question for question in further if " when you " in question.text]
    assert len({question.question_type for question in questions}) == 2
    for question in questions:
        moment = question.text.partition(" when you ")[2]
        action = next(action for words, action in verbs.items() if moment.startswith(words))
        steps = [logs[question.traj_id][clue] for clue in question.clues]
        # A later frame, with what was picked up still in the hand, shows it as well.
        assert [
            step
            for step in steps
            if (step.success and (step.action or "").startswith(action))
            or any(with_the(held) in moment for held in step.object_log.inven_obj)
        ], question


def test_gold_answers_score_full_marks(everything):
    for question in everything.questions:
        reply = ", ".join(str(answer) for answer in question.answers)
        for scorer in ("reference", "strict"):
            assert score(reply, question.answers, scorer=scorer) == 1.0, question


def test_the_checker_notices_what_is_wrong(everything, logs):
    checkers = {name: Checker(steps, DEFAULT_SHARE) for name, steps in logs.items()}
    # Of further counts, one frame more or less without an occasion does no harm.
    others = {"object_presence", "movement_counting_further"}
    for question in of_types(everything, *(QUESTION_TYPES | FURTHER_TYPES) - others):
        checker = checkers[question.traj_id]
        assert not checker.verdict(replace(question, answers=("teapot",))).right
        first = 0 if 0 not in question.clues else 1
        assert not checker.verdict(replace(question, clues=(first, *question.clues))).sound
        if len(question.clues) > 1:
            assert not checker.verdict(replace(question, clues=question.clues[1:])).sufficient


def test_choice_is_balanced_and_seeded(replayed):
    generated = [generate_questions(replayed, seed=seed, per_trajectory=25) for seed in (0, 0, 1)]
    assert generated[0].questions == generated[1].questions != generated[2].questions
    questions = generated[0].questions
    assert len(questions) <= 25 * len({question.traj_id for question in questions})
    answers = Counter(question.answers for question in questions)
    assert abs(answers["yes",] - answers["no",]) <= 5
    assert set(generated[0].by_type()) >= QUESTION_TYPES - RARE
    assert len(questions) < len(generate_questions(replayed, by_subject=False).questions)


def test_absences_are_flagged_and_look_like_presences(everything):
    presence = of_types(everything, "object_presence")
    assert {question.absence for question in presence} == {True, False}
    for question in everything.questions:
        assert question.absence == (
            question.question_type == "object_presence" and question.answers == ("no",)
        )
    assert {len(question.clues) for question in presence} == {1}


def test_no_answer_follows_from_the_form_or_the_object_of_a_question(replayed):
    generated = generate_questions(replayed, per_trajectory=60, further=True)
    answers = defaultdict(Counter)
    for question in generated.questions:
        if str(question.answers[0]) in {"yes", "no"} or str(question.answers[0]).isdecimal():
            answers[_form(question.text)][question.answers[0]] += 1
    assert len(answers) > 4
    for form, counts in answers.items():
        most = counts.most_common(1)[0][1]
        assert most <= counts.total() - most + 1, (form, counts)
    on_object = defaultdict(Counter)
    for question in of_types(generated, "object_presence"):  # both trajectories are in a kitchen
        thing = re.sub(r"Is there any|Have you seen an?|in this room|\W", "", question.text)
        on_object[thing][question.answers] += 1
    counts = on_object.values()
    assert counts and all(abs(count["yes",] - count["no",]) <= 1 for count in counts)


def _form(text):
    words = text.split()
    return (
        " ".join(words[:5])
        if words[0] == "How"
        else next(form for form in CLOSED if re.fullmatch(form, text))
    )


def test_texts_are_english(everything):
    for question in everything.questions:
        assert question.text[0].isupper() and question.text.endswith("?")
        for wrong in (" a apple", " a egg", " an mug", "  ", " a bread"):
            assert wrong not in question.text


def test_no_answer_is_in_its_question(everything):
    for question in everything.questions:
        if question.answers[0] not in {"yes", "no"} and "when you sliced" not in question.text:
            words = question.text.lower().replace(" ", "")
            assert not [
                answer for answer in question.answers if len(answer) > 2 and answer in words
            ], question


def test_a_log_without_what_frames_show_is_skipped(replayed, tmp_path):
    with pytest.raises(DataError, match="does not say what the frames show"):
        TrajectoryHistory("t", [Step(0, "0.png")])
    with pytest.raises(DataError, match="has no trajectory; replay"):
        generate_questions(tmp_path)


def test_a_log_that_contradicts_itself_is_skipped_and_the_others_are_asked_about(
    replayed, tmp_path
):
    shutil.copytree(replayed, tmp_path / "set")
    path = tmp_path / "set/metadata/kitchen-3-seed4/metadata.json"
    steps = json.loads(path.read_text())
    opened = next(step for step in steps if (step.get("action") or "").startswith("PickupObject"))
    opened["target"] = "Mug|+09.00|+09.00|+09.00"  # which is nowhere
    path.write_text(json.dumps(steps))
    generated = generate_questions(tmp_path / "set", per_trajectory=10)
    (line,) = generated.skipped
    reason = "its log is inconsistent (no 'Mug|+09.00|+09.00|+09.00'); replay"
    assert f"kitchen-3-seed4: {reason}" in line
    names = {question.traj_id for question in generated.questions}
    assert names == {"kitchen-2-seed2", "kitchen-5-seed4"}
