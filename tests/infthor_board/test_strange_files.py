"""What strangers send instead of replies: each is refused for what it is, and ends nobody else's
check."""

import json
import os
import shutil
import subprocess
import zipfile

import pytest

from infthor_board.checking import check_submissions
from tests.infthor_board.material import submit

from .forging import honest

_ROW = {
    "evaluation_id": "x",
    "model_id": "lab/model",
    "evaluation_result_id": "nieh_gt/strict",
    "evaluation": {"score": 1.0},
    "output": {"raw": ["mug"]},
}


def _export(root, name, record, row, **metadata):
    told = {"task": "nieh_gt", "question_id": record.id, **metadata}
    path = root.parent / f"{name}_samples.jsonl"
    path.write_text(json.dumps({**_ROW, "sample_id": record.id, "metadata": told, **row}) + "\n")
    return submit(root, name, path, engine="vllm")


def _inspect(root, name, record, **sample):
    path = root.parent / f"{name}.eval"
    output = {"choices": [{"message": {"content": "mug"}}]}
    document = {"id": record.id, "metadata": {"task": "nieh_gt"}, "output": output, **sample}
    with zipfile.ZipFile(path, "w") as archive:
        header = {"eval": {"task": "nieh_gt", "model": "lab/model"}}
        archive.writestr("header.json", json.dumps(header))
        archive.writestr("samples/1.json", json.dumps(document))
    return submit(root, name, path, engine="vllm")


def _nest(folder, depth):
    """Make folders in each other: the whole path is longer than any call takes."""
    at = os.open(folder, os.O_RDONLY)
    for _ in range(depth):
        os.mkdir("a", dir_fd=at)
        inner = os.open("a", os.O_RDONLY, dir_fd=at)
        os.close(at)
        at = inner
    os.close(at)


def _link(path, target):
    shutil.move(path, target)
    path.symlink_to(target)


@pytest.fixture(scope="module")
def verdicts(material, owner, tmp_path_factory):
    """The verdicts on all of them, and on a good one among them, of one call."""
    outside = tmp_path_factory.mktemp("outside")
    root = outside / "all"
    run = honest(material)
    record = run.records[0]
    submit(root, "good", run)
    for name, score in (("huge", 10**400), ("nan", float("nan")), ("endless", float("inf"))):
        _export(root, f"{name} score", record, {"evaluation": {"score": score}})
        means = {"evaluation_result_id": "nieh_gt/strict", "score_details": {"score": score}}
        folder = _export(root, f"{name} mean", record, {})
        summary = json.dumps({"evaluation_results": [means]})
        (folder / f"{name} mean.json").write_text(summary)
    _export(root, "repeated", record, {}, repeat="20000000")
    _export(root, "often", record, {}, repeat=9_999)
    _export(root, "texts", record, {"output": {"raw": ["mug"] * 100_000}})
    _inspect(root, "epoch", record, epoch=10**9)
    _inspect(root, "score of inspect", record, scores={"strict": {"value": 10**400}})
    _nest(submit(root, "deep", run), 1_500)
    _nest(submit(root, "deeper", run), 5_000)
    journal = next(submit(root, "linked journal", run, date="2026-06-02").rglob("journal"))
    _link(journal, outside / "journal")
    shard = next(submit(root, "linked shard", run, date="2026-06-02").rglob("worker-0.jsonl"))
    _link(shard, outside / "shard")
    results = next(submit(root, "linked results", run, date="2026-06-02").rglob("results.json"))
    _link(results, outside / "results")
    _link(submit(root, "linked statement", run) / "submission.yaml", outside / "statement")
    _link(submit(root, "linked folder", run, date="2026-06-02"), outside / "folder")
    try:
        return {it.case.submission.folder.name: it for it in check_submissions(root, owner)}
    finally:
        for name in ("deep", "deeper"):  # too deep for Python's own functions
            subprocess.run(["rm", "-r", root / name], check=True)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("huge score", "1 stored scores"),
        ("nan score", "1 stored scores"),
        ("endless score", "1 stored scores"),
        ("huge mean", "its results have inf %"),
        ("nan mean", "not valid JSON"),
        ("endless mean", "not valid JSON"),
        ("repeated", "is repetition 20,000,000; at most 10,000 are read"),
        ("often", "60 questions were asked 9,999 times, and has 1 replies"),
        ("texts", "Expected `array` of length <= 10000"),
        ("epoch", "Expected `int` <= 10000"),
        ("score of inspect", "1 stored scores"),
        ("deeper", "cannot be searched"),
        ("linked journal", "is a link, which is not followed"),
        ("linked shard", "is a link, which is not followed"),
        ("linked results", "is a link, which is not followed"),
        ("linked statement", "is a link, which is not followed"),
        ("linked folder", "is a link, which is not followed"),
    ],
)
def test_it_is_refused_for_what_it_is(verdicts, name, words):
    reasons = [problem.text for problem in verdicts[name].refusals]
    assert any(words in reason for reason in reasons), reasons
    assert not any("Error in" in reason or "\n" in reason for reason in reasons), reasons


@pytest.mark.parametrize("name", ["good", "deep"])
def test_a_good_one_among_them_passes(verdicts, name):
    refusals = [it for it in verdicts[name].refusals if it.check not in ("records", "copied")]
    assert refusals == []


def test_what_nobody_foresaw_is_a_reason_too(material, owner, tmp_path, monkeypatch):
    for name in ("a", "b"):
        submit(tmp_path, name, honest(material, model=f"lab/{name}"))
    places = ("reading._read_journal", "expected._grade", "expected._options")
    for place in places:
        with monkeypatch.context() as patch:
            patch.setattr(f"infthor_board.{place}", {}.__getitem__)
            verdicts = check_submissions(tmp_path, owner)
        assert len(verdicts) == 2
        assert all("Error in" in verdict.refusals[0].text for verdict in verdicts)
