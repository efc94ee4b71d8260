"""The exact log has all that is asked, told by who reads it without the set."""

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.samples import find_samples

from ..helpers.benchmarks import load_benchmark

EVERY = 7  # questions; all would take half a minute


@pytest.fixture(scope="module")
def read():
    return load_benchmark("log_reader").answer


@pytest.mark.parametrize("bundled", ["nieh_mini", "nieh_mini_twins"])
def test_the_log_alone_answers_what_is_asked(read, bundled):
    settings = {"bundled": bundled, "context": "memory", "memory": "text-log", "frames": "none"}
    samples = recall_all(find_samples(settings))
    assert len(samples) > 100
    for sample in samples[::EVERY]:
        question: Question = sample.question
        (log,) = sample.recalled
        said = read([log, f"\nBe brief.\nQuestion: {question.text}"])
        assert sorted(said.split(", ")) == sorted(map(str, question.answers)), question.text


def test_what_is_not_told_is_not_known(read):
    assert read(["Step 0: sees Mug 1.\n", "Question: Where is the mug now?"]) == "not sure"
    assert read(["Question: Where is the mug now?"]) == "not sure"
