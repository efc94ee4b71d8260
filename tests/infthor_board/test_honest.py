"""Honest submissions: they pass, whatever they are made of."""

import json
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from infthor_eval.nieh.rescoring.rescore import Source
from tests.infthor_board.material import (
    edit_journal,
    guesser,
    reader,
    reply_with,
    run_model,
    submit,
)

HONEST = {}


def honest(make):
    """A function that writes an honest submission."""
    HONEST[make.__name__] = make
    return make


def run_of(material, name="homes", frames="shown", skill=0.5, seed="honest", **options):
    return reply_with(material.runs[name, frames], reader(skill, seed), **options)


@honest
def a_reader(material, root, _):
    return submit(root, "sent", run_of(material))


@honest
def a_good_reader(material, root, _):
    return submit(root, "sent", run_of(material, skill=0.95))


@honest
def one_that_always_says_the_same(material, root, _):
    return submit(root, "sent", reply_with(material.runs["homes", "shown"], guesser))


@honest
def the_baseline_random(material, root, _):
    run = material.runs["homes", "shown"]
    return submit(root, "sent", run, model="infthor-eval/random", revision="0.1.0")


@honest
def singles_pairs_and_a_control(material, root, _):
    def same_in_both_worlds(record):
        return "no" if record.payload.question.startswith("Is") else "bowl"

    return submit(
        root,
        "sent",
        run_of(material),
        run_of(material, "twins", skill=0.4),
        reply_with(material.runs["twins", "blank"], same_in_both_worlds),
    )


@honest
def whole_trajectories(material, root, _):
    return submit(root, "sent", run_of(material, "whole"))


@honest
def a_run_with_a_failed_question(material, root, _):
    run = run_of(material)
    failed = replace(
        run.records[3],
        failure="out of memory",
        payload=replace(run.records[3].payload, reply=None, scores={}),
    )
    return submit(root, "sent", Source(run.header, [*run.records[:3], failed, *run.records[4:]]))


@honest
def a_resumed_run(material, root, _):
    run = run_of(material)
    folder = submit(root, "sent", run)
    lost = replace(
        run.records[3],
        failure="the server went away",
        payload=replace(run.records[3].payload, reply=None, scores={}),
    )

    def edit(lines):
        lines.insert(1, msgspec.to_builtins(lost))
        next(it for it in lines[2:] if it["id"] == lost.id)["attempt"] = 2

    return edit_journal(folder, edit)


@honest
def replies_in_lines(material, root, _):
    run = run_of(material)
    path = root / "replies.jsonl"
    rows = [{"question_id": it.id, "reply": it.payload.reply} for it in run.records]
    path.write_bytes(b"".join(msgspec.json.encode(row) + b"\n" for row in rows))
    return submit(root, "sent", path, task="nieh_gt", engine="a server")


def exported(material, root, export, file_format, suffix):
    stored = submit(root, "stored", run_of(material))
    (run,) = (path.parent for path in stored.rglob("journal"))
    found = list(export(run, file_format).rglob(f"*{suffix}"))
    return submit(root, "sent", *found, engine="vllm 0.9")


@honest
def every_eval_ever(material, root, export):
    return exported(material, root, export, "every-eval-ever", ".jsonl")


@honest
def an_inspect_log(material, root, export):
    return exported(material, root, export, "inspect", ".eval")


@honest
def a_replication(material, root, _):
    submit(root / "others", "theirs", run_of(material))
    again = run_of(material, repetition="again")
    return submit(root, "sent", again, submitted_by="another lab", date="2026-06-05")


@honest
def two_models_that_agree_on_much(material, root, _):
    submit(root / "others", "theirs", run_of(material, model="other/model"))
    ours, theirs = reader(0.5, "mine"), reader(0.5, "honest")

    def reply(record):
        return (theirs if int(record.fingerprint or "0", 16) % 2 else ours)(record)

    return submit(root, "sent", reply_with(material.runs["homes", "shown"], reply))


@pytest.fixture
def export(tmp_path: Path, run_cli):
    """Exports a run; returns the folder of the export."""

    def export(run: Path, file_format: str) -> Path:
        out = tmp_path / "exported"
        code, _, err = run_cli("export", run, "--format", file_format, "--out", out)
        assert code == 0, err
        return out

    return export


@pytest.mark.parametrize("name", HONEST)
def test_it_passes(name, material, check, export, tmp_path):
    folder = HONEST[name](material, tmp_path, export)
    others = tmp_path / "others" if (tmp_path / "others").exists() else None
    assert check(folder, others).refusals == []


def test_there_are_ten():
    assert len(HONEST) >= 10


def test_the_bundled_model_passes(material, check, tmp_path):
    run_model(tmp_path / "sent", model="qwen2.5-vl-nano", tasks="nieh_gt", data=material.homes)
    submit(tmp_path / "statement", "sent", model="infthor-eval/nano")
    statement = tmp_path / "statement" / "sent" / "submission.yaml"
    statement.rename(tmp_path / "sent" / "submission.yaml")
    text = (tmp_path / "sent" / "submission.yaml").read_text()
    (tmp_path / "sent" / "submission.yaml").write_text(text.replace("abcdef123456", "0.1.0"))
    assert check(tmp_path / "sent").refusals == []


def test_what_is_at_a_guess_is_said_and_not_refused(material, check, tmp_path):
    folder = submit(tmp_path, "sent", reply_with(material.runs["homes", "shown"], guesser))
    remarks = {problem.check for problem in check(folder).warnings}
    assert {"above blind", "above other home"} <= remarks


def test_an_export_with_an_edited_score_is_refused(material, check, export, tmp_path):
    folder = exported(material, tmp_path, export, "every-eval-ever", ".jsonl")
    (path,) = folder.glob("*.jsonl")
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    wrong = next(row for row in rows if row["evaluation"]["score"] == 0)
    wrong["evaluation"]["score"] = 1.0
    path.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    refusals = {problem.check: problem.text for problem in check(folder).refusals}
    assert "1 stored scores" in refusals["scores"]


def test_an_export_with_an_edited_summary_is_refused(material, check, export, tmp_path):
    folder = exported(material, tmp_path, export, "every-eval-ever", ".json")
    samples = exported(material, tmp_path / "again", export, "every-eval-ever", ".jsonl")
    (path,) = samples.glob("*.jsonl")
    path.rename(folder / path.name)
    assert check(folder).refusals == []
    (summary,) = folder.glob("*.json")
    document = json.loads(summary.read_text())
    for result in document["evaluation_results"]:
        result["score_details"]["score"] = 0.99
    summary.write_text(json.dumps(document))
    refusals = {problem.check: problem.text for problem in check(folder).refusals}
    assert "its results have 99.00 %" in refusals["results"]


def test_an_export_without_some_questions_is_refused(material, check, export, tmp_path):
    folder = exported(material, tmp_path, export, "every-eval-ever", ".jsonl")
    (path,) = folder.glob("*.jsonl")
    gone = "bedroom-1-a/"
    lines = [line for line in path.read_text().splitlines() if gone not in line]
    path.write_text("\n".join(lines) + "\n")
    refusals = {problem.check: problem.text for problem in check(folder).refusals}
    assert "10 questions" in refusals["complete"]
