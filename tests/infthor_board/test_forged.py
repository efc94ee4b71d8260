"""Forged submissions, each refused for what was forged in it."""

import shutil
from pathlib import Path

import pytest

from infthor_board.checking import check_submissions
from tests.infthor_board.material import reply_with, submit

from . import forged_answers, forged_runs
from .forging import honest, key

FORGERIES = forged_answers.FORGERIES | forged_runs.FORGERIES


@pytest.mark.parametrize("name", FORGERIES)
def test_it_is_refused_for_what_was_forged(name, material, check, tmp_path):
    make, by, words = FORGERIES[name]
    folder = make(material, tmp_path)
    others = tmp_path / "others" if (tmp_path / "others").exists() else None
    verdict = check(folder, others)
    reasons = [problem.text for problem in verdict.refusals if problem.check == by]
    assert any(words in reason for reason in reasons), verdict.refusals
    assert not any("\n" in problem.text for problem in verdict.problems)


def test_more_than_twenty_forgeries_are_all_different():
    assert len({(by, words, name) for name, (_, by, words) in FORGERIES.items()}) >= 20


def test_the_same_run_passes_without_the_forgery(material, check, tmp_path):
    assert check(submit(tmp_path, "honest", honest(material))).refusals == []


def test_who_came_first_is_not_refused_for_the_copy(material, owner, tmp_path):
    submit(tmp_path, "first", honest(material, model="lab/good"), date="2026-06-01")
    submit(tmp_path, "later", honest(material, model="forger/better"), date="2026-06-02")
    verdicts = check_submissions(tmp_path, owner)
    assert [bool(verdict.refusals) for verdict in verdicts] == [False, True]
    assert verdicts[1].refusals[0].check == "copied"


def test_the_owner_may_allow_what_a_check_refuses(material, check, tmp_path):
    folder = submit(tmp_path, "key", reply_with(material.runs["homes", "shown"], key))
    allowed = ("key words", "key spelling", "key score")
    assert check(folder, allowed=allowed).refusals == []
    assert set(allowed) <= {problem.check for problem in check(folder, allowed=allowed).warnings}


def test_one_bad_submission_does_not_stop_the_others(material, owner, tmp_path: Path):
    good = submit(tmp_path, "good", honest(material))
    shutil.copytree(good, tmp_path / "bad")
    (tmp_path / "bad" / "submission.yaml").write_text("model: [1, 2")
    verdicts = {it.case.submission.name: it for it in check_submissions(tmp_path, owner)}
    assert not verdicts["good"].refusals
    assert "not YAML" in verdicts["bad"].refusals[0].text
