"""A reader that makes no mistake has what is shown, and nothing else."""

from typing import Any

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.storage.folders import packaged_folder

from ..helpers.benchmarks import load_benchmark

EVERY = 15  # questions; all would take a minute


@pytest.fixture(scope="module")
def reader() -> Any:
    module = load_benchmark("perfect_reader")
    return module.PerfectReader.build("reader", module.ReaderOptions(), 0)


@pytest.fixture(scope="module")
def twins() -> NiehSet:
    return NiehSet(packaged_folder("sets/nieh_mini_twins"))


def test_clue_frames_have_the_answer_of_their_own_world(reader, twins):
    for question in twins.questions[::EVERY]:
        said = reader.answer(twins.clue_frames(question), f"Look. {question.text} Be brief.")
        assert sorted(said.split(", ")) == sorted(map(str, question.answers))


def test_without_evidence_it_does_not_know(reader, twins):
    (where, *_) = [each for each in twins.questions if each.text.startswith("Where is the")]
    assert reader.answer((), where.text) == "not sure"
    (there, *_) = [each for each in twins.questions if each.text.startswith("Is there any")]
    assert reader.answer((), there.text) == "no"
    frames = twins.frames(where.traj_id)
    assert reader.answer(frames[:1], "What is the time?") == "not sure"
