"""What was exported comes back as a run with the same scores."""

import json
import shutil
import struct
import zipfile

import pyarrow
import pytest

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.runs.journals.shards import find_shards
from tests.helpers.command_line import assert_refused

FORMATS = ("every-eval-ever", "inspect", "lm-eval")
ZSTANDARD = 93


def samples_of(out):
    """The file with the samples of the one run in an export."""
    (path,) = [path for path in out.rglob("*") if path.suffix == ".eval" or "samples" in path.name]
    return path


@pytest.fixture
def bring_back(twin_set, tmp_path, run_cli):
    """Imports a file with replies; returns the folder of the run, and what was said."""

    def bring_back(path, *options, code=0):
        output = tmp_path / "back"
        words = ("--data", twin_set, "--out", output, *options)
        ended, _, err = run_cli("import-replies", path, *words)
        assert ended == code, err
        (folder,) = output.glob("*/*")
        return folder, err

    return bring_back


def results(run):
    document = json.loads((run / "results.json").read_text())
    (summary,) = document["summary"]["tasks"].values()
    return document, summary


@pytest.mark.parametrize("file_format", FORMATS)
def test_replies_and_scores_are_equal(questions_run, export, bring_back, file_format):
    samples = samples_of(export(questions_run, file_format))
    back, _ = bring_back(samples, *(("--model", "me") if file_format == "lm-eval" else ()))
    records, returned = (read_run(run, RECORDS)[1] for run in (questions_run, back))
    said = [
        {(it.id, it.variant, it.repeat): (it.payload.reply, it.payload.scores) for it in run}
        for run in (records, returned)
    ]
    assert said[0] == said[1]
    (_, before), (_, after) = results(questions_run), results(back)
    assert after["pairs"]["net_pairs"] == before["pairs"]["net_pairs"]
    assert after["pairs"]["single"] == before["pairs"]["single"]
    assert after["by_clues"]["total"]["scores"] == before["by_clues"]["total"]["scores"]
    assert after["above_blind"] == before["above_blind"]


@pytest.mark.parametrize("file_format", ["every-eval-ever", "inspect"])
def test_what_was_shown_comes_back(questions_run, export, bring_back, file_format):
    back, _ = bring_back(samples_of(export(questions_run, file_format)))
    payloads = [
        {(it.id, it.repeat): it.payload for it in read_run(run, RECORDS)[1]}
        for run in (questions_run, back)
    ]
    assert payloads[0] == payloads[1]
    header, _ = read_run(back, RECORDS)
    assert (header.name, list(header.config.tasks)) == ("infthor-eval/random", ["nieh_gt"])
    assert header.config.tasks["nieh_gt"].context == "clues"


@pytest.mark.parametrize("file_format", ["every-eval-ever", "inspect"])
def test_a_failed_question_is_a_failed_one(
    questions_run, export, bring_back, tmp_path, file_format
):
    run = tmp_path / "run"
    shutil.copytree(questions_run, run)
    (shard,) = find_shards(run)
    lines = [json.loads(line) for line in shard.read_text().splitlines()]
    first = next(line for line in lines if line["type"] == "unit")
    first["failure"] = "the server says no; ask another"
    first["payload"].pop("reply")
    first["payload"].pop("scores")
    shard.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    back, _ = bring_back(samples_of(export(run, file_format)))
    failed = [record for record in read_run(back, RECORDS)[1] if record.failure]
    assert [(record.id, record.failure) for record in failed] == [(first["id"], first["failure"])]
    assert results(back)[0]["units"]["nieh_gt"]["failed"] == 1


def test_a_control_comes_back_as_one(twin_set, tmp_path, run_cli, export, bring_back):
    words = ("--model", "blind", "--tasks", "nieh_gt", "--data", twin_set, "--frames", "blank")
    assert run_cli(*words, "--out", tmp_path / "out")[0] == 0
    (run,) = (tmp_path / "out").glob("*/*")
    back, _ = bring_back(samples_of(export(run, "every-eval-ever")))
    assert read_run(back, RECORDS)[0].config.frames == "blank"


def test_a_log_packed_with_zstandard(questions_run, export, bring_back, tmp_path):
    """As inspect_ai itself writes them."""
    packed = tmp_path / "packed.eval"
    _pack(samples_of(export(questions_run, "inspect")), packed)
    with zipfile.ZipFile(packed) as archive:
        assert {it.compress_type for it in archive.infolist()} == {ZSTANDARD}
    back, _ = bring_back(packed)
    assert results(back)[1]["n"] == results(questions_run)[1]["n"]


def _pack(source, target):
    """Write a log again, its members packed with zstandard: Python's writer does not know it, so
    that they are stored packed, and the headers changed."""
    sizes = {}
    with zipfile.ZipFile(source) as read, zipfile.ZipFile(target, "w") as written:
        for name in read.namelist():
            content = read.read(name)
            sizes[name] = len(content)
            written.writestr(name, pyarrow.compress(content, "zstd", asbytes=True))
        members = written.infolist()
    whole = bytearray(target.read_bytes())
    for member in members:
        struct.pack_into("<H", whole, member.header_offset + 8, ZSTANDARD)
        struct.pack_into("<I", whole, member.header_offset + 22, sizes[member.filename])
    at = whole.index(b"PK\x01\x02")
    for member in members:
        struct.pack_into("<H", whole, at + 10, ZSTANDARD)
        struct.pack_into("<I", whole, at + 24, sizes[member.filename])
        at = whole.find(b"PK\x01\x02", at + 4)
    target.write_bytes(whole)


def test_episodes_are_no_replies(scripted_run, export, twin_set, run_cli, tmp_path):
    for file_format in ("every-eval-ever", "inspect"):
        samples = samples_of(export(scripted_run, file_format))
        words = ("--data", twin_set, "--out", tmp_path / "out")
        assert_refused(
            run_cli("import-replies", samples, *words), "no row answers a question of this set"
        )
        shutil.rmtree(tmp_path / "exported")


def encrypt(path):
    content = bytearray(path.read_bytes())
    at = content.find(b"PK\x01\x02")
    while at >= 0:
        content[at + 8] |= 1
        at = content.find(b"PK\x01\x02", at + 4)
    path.write_bytes(content)


def leave_no_header(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("samples/a_epoch_1.json", "{}")


@pytest.mark.parametrize(
    ("suffix", "damage", "reason"),
    [
        ("eval", lambda it: it.write_bytes(b"no"), "not a log of inspect_ai (File is not a zip "),
        ("eval", lambda it: it.write_bytes(b""), "not a log of inspect_ai"),
        ("yaml", lambda it: it.write_text("- value: 3\n"), "has results, and no replies"),
        ("eval", encrypt, "is encrypted"),
        ("eval", leave_no_header, "has no header.json"),
    ],
)
def test_a_file_without_replies_is_one_line(
    questions_run, export, twin_set, run_cli, tmp_path, suffix, damage, reason
):
    path = samples_of(export(questions_run, "inspect")).rename(tmp_path / f"run.{suffix}")
    damage(path)
    words = ("--data", twin_set, "--out", tmp_path / "out", "--model", "me")
    assert_refused(run_cli("import-replies", path, *words), reason)
