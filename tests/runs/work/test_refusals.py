"""What cannot be run is refused before anything is done."""

from pathlib import Path

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.runs import prepare
from tests.helpers.toy_suite import Adder, ToySuite, make_suite, run
from tests.runs.toy_command import request


def test_a_subject_that_cannot_do_what_the_suite_needs_is_refused(tmp_path, monkeypatch):
    class Policy(Adder):
        def act(self, frame, instruction):
            raise AssertionError

        def reset(self):
            raise AssertionError

    monkeypatch.setattr("infthor_eval.runs.request.is_known", lambda name: name == "arm")
    monkeypatch.setattr("infthor_eval.runs.request.check_options", lambda *_: None)
    monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: Policy())
    with pytest.raises(
        UsageError,
        match="arm cannot be evaluated on toy, which needs a model that answers in words",
    ):
        run(request(tmp_path, model="arm"))


def test_a_file_that_may_be_meant_by_an_unknown_name_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("edge.py").touch()
    with pytest.raises(UsageError, match=r"in \./edge\.py is meant, give --model edge\.py:CLASS"):
        prepare(request(tmp_path, model="edge"), ToySuite())


def test_unknown_names_and_options_are_refused_before_anything_is_done(tmp_path):
    with pytest.raises(UsageError, match="did you mean 'adder'"):
        prepare(request(tmp_path, model="ader"), ToySuite())
    with pytest.raises(UsageError, match="adder has no option a"):
        prepare(request(tmp_path, model_options={"a": "1"}), ToySuite())


def test_a_suite_that_refuses_its_work_ends_before_a_journal_is_begun(tmp_path):
    def refuse():
        raise ModelError("no")

    closed = []

    class Held(Adder):
        def __init__(self, seed):
            super().__init__(seed)
            self.close = lambda: closed.append(self)

    suite = make_suite(refuse)
    suite.baselines = {"adder": Held}
    with pytest.raises(ModelError, match="no"):
        run(request(tmp_path), suite)
    assert len(closed) == 1
    assert not list(tmp_path.iterdir())
