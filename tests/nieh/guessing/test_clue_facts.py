"""Facts of clue frames and scenes, on the bundled set and on files without logs."""

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.step_log import read_steps
from infthor_eval.nieh.guessing.audit import audit
from infthor_eval.nieh.guessing.clue_facts import read_clue_facts, read_scenes
from infthor_eval.nieh.guessing.guessers import GUESSERS
from infthor_eval.storage.folders import packaged_folder

from ...helpers.questions import make_question


@pytest.fixture(scope="module")
def bundled():
    return NiehSet(packaged_folder("sets/nieh_mini"))


def test_facts_are_those_of_the_clue_frames(bundled):
    facts = read_clue_facts(bundled)
    assert facts.keys() == {question.id for question in bundled.questions}
    steps = {path.name: read_steps(path) for path in bundled.folder("").iterdir()}
    for question in bundled.questions:
        log = steps[question.traj_id]
        assert len(facts[question.id]) == len(question.clues)
        for clue, fact in zip(sorted(question.clues), facts[question.id], strict=True):
            assert fact.hand_full == bool(log[clue].object_log.inven_obj)
            assert fact.progress == clue / (len(log) - 1)
            assert 0 <= fact.n_at_edge <= fact.n_in_view <= len(log[clue].seen)
    assert {fact.hand_full for of_one in facts.values() for fact in of_one} == {True, False}


def test_scenes_are_those_of_the_trajectories(bundled):
    scenes = read_scenes(bundled)
    assert len(scenes) == 6 and scenes["kitchen-1-seed5"] == "kitchen-1"


def test_a_set_with_logs_is_audited_by_who_knows_their_facts_and_without_whole_scenes(bundled):
    audited = audit(bundled)
    assert len(audited.guessers) == len(GUESSERS) + 2
    assert "facts" in audited.guessers[-2]
    assert audited.guessers[-1] == "blind"
    assert all(
        len(item.scores) == len(item.scene_scores) == len(audited.guessers)
        for item in audited.questions
    )
    (everything,) = audited.groups("file")
    # A scene has one trajectory here, so both are learned from the same questions.
    assert everything.best_without_scene() == everything.best()[1]


def test_without_logs_there_are_no_facts_and_no_scenes(tmp_path):
    write_questions(tmp_path / "qa_set_test.csv", [make_question(f"t{i}") for i in range(2)])
    data = NiehSet(tmp_path)
    assert not read_clue_facts(data) and not read_scenes(data)
    assert audit(data).groups("file")[0].best_without_scene() is None
