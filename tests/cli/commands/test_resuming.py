"""Runs that are resumed, restarted, recovered or named."""

import json
import os
import signal

import pytest

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.runs.journals.journal import Journal

from ...helpers.command_line import assert_refused, option_words
from ...helpers.files import find_one


@pytest.fixture
def ask(make_nieh_set, tmp_path, run_cli):
    """Runs `nieh_gt` with the tiny model, for 5 samples."""
    data = make_nieh_set(size=56)

    def ask(*options, model="qwen2.5-vl-tiny"):
        arguments = option_words(model=model, tasks="nieh_gt", data=data, out=tmp_path / "out")
        return run_cli(*arguments, *options)

    return ask


def replies(folder):
    return {record.key: record.payload.reply for record in read_run(folder, RECORDS)[1]}


def test_a_name_appears_in_the_folder_the_table_and_the_results(ask, tmp_path):
    assert ask(model="oracle")[0] == 0
    code, out, err = ask("--name", "upper bound", model="oracle")
    assert code == 0
    results = json.loads(find_one(tmp_path / "out" / "upper bound", "results.json").read_text())
    assert results["name"] == "upper bound"
    assert any(line.split()[:3] == ["upper", "bound", "nieh_gt"] for line in out.splitlines())
    assert f"upper bound: {tmp_path / 'out' / 'upper bound'}" in out.replace("\n", "")
    assert "upper bound: 5 evaluated now" in err
    # The name is no part of what the run is: it lies in a folder of the same digest.
    assert [path.name for path in sorted((tmp_path / "out").iterdir())] == ["oracle", "upper bound"]
    assert len({path.parent.name for path in (tmp_path / "out").rglob("results.json")}) == 1


@pytest.mark.parametrize("name", ["../up", "a/b", "", ".hidden", "-x\n", "both"])
def test_a_name_that_cannot_be_a_folders_or_is_for_two_models_is_refused(ask, tmp_path, name):
    model, expected = "oracle", "names a folder"
    if name == "both":
        model, expected = "oracle,blind", "--name both: names one run, but 2 models are given"
    assert_refused(ask(f"--name={name}", model=model), expected)
    assert not (tmp_path / "out").exists()


def test_fresh_restarts_and_keeps_every_earlier_journal(ask, tmp_path):
    ask()
    journal = find_one(tmp_path / "out", "journal")
    folder, first = journal.parent, (journal / "worker-0.jsonl").read_bytes()
    for number in (1, 2):
        code, _, err = ask("--fresh")
        assert code == 0
        assert "5 evaluated now, 0 resumed from the journal" in err
        assert sorted(path.name for path in folder.glob("journal*")) == [
            "journal",
            *(f"journal.{each}" for each in range(1, number + 1)),
        ]
    assert (folder / "journal.1" / "worker-0.jsonl").read_bytes() == first
    assert "0 evaluated now, 5 resumed from the journal" in ask()[2]


def test_fresh_without_an_earlier_run_changes_nothing(ask, tmp_path):
    code, _, err = ask("--fresh", "--recover", model="oracle")
    assert code == 0
    assert "5 evaluated now, 0 resumed" in err
    assert not list(tmp_path.rglob("journal.1"))


@pytest.mark.parametrize("option", ["--fresh", "--recover"])
def test_the_journal_of_an_active_run_is_left_alone(ask, tmp_path, option):
    ask(model="oracle")
    folder = find_one(tmp_path / "out", "journal").parent
    with Journal(folder, read_run(folder, RECORDS)[0], RECORDS):
        code, out, err = ask(option, model="oracle")
    assert (code, out) == (2, "")
    assert "another run is writing it; wait for it or stop it" in err
    assert not list(folder.glob("journal.*"))
    assert len(replies(folder)) == 5


def _spoil_two_units(lines):
    first, second, *_ = (at for at, line in enumerate(lines) if b'"type":"unit"' in line)
    spoiled = {first: lines[first][:40] + b"\x00\n", second: b'{"type":"unit","task":"nieh_gt"}\n'}
    return [spoiled.get(at, line) for at, line in enumerate(lines)]


# What is done to the lines of a journal, what is said of the first bad one, and how many units it
# costs.
BAD_JOURNALS = {
    "bad lines": (_spoil_two_units, "not a line of a journal", 2),
    "no first line": (
        lambda lines: [b"no header\n", *lines[1:]],
        "not the first line of a journal",
        0,
    ),
    "two journals": (lambda lines: lines * 2, "a second header in the middle of the records", 0),
}


@pytest.mark.parametrize("name", BAD_JOURNALS)
def test_a_bad_line_in_a_journal_is_named_and_recovered_from(ask, tmp_path, name):
    damage, expected, n_lost = BAD_JOURNALS[name]
    ask()
    path = find_one(tmp_path / "out", "worker-0.jsonl")
    before, lines = replies(path.parents[1]), path.read_bytes().splitlines(keepends=True)
    damaged = damage(lines)
    bad = [line for line in damaged if line not in lines] or lines[:1]  # a second header
    number = damaged.index(bad[0], 0 if bad[0] not in lines else 1) + 1
    path.write_bytes(b"".join(damaged))
    assert_refused(ask(), f"{path}, line {number}: {expected}", "--recover", after_notes=True)
    assert path.read_bytes() == b"".join(damaged)

    code, _, err = ask("--recover")
    assert code == 0
    told = "bad line(s) of the journal set aside; those samples are tried again"
    assert f"qwen2.5-vl-tiny: {len(bad)} {told}" in err
    assert f"{n_lost} evaluated now, {5 - n_lost} resumed from the journal" in err
    assert replies(path.parents[1]) == before
    assert (path.parent / "bad_lines.txt").read_bytes() == b"".join(bad)
    code, _, err = ask("--recover")
    assert "bad line" not in err
    assert "0 evaluated now, 5 resumed from the journal" in err


def test_ctrl_c_at_the_last_sample_of_a_model_begins_no_other(ask, tmp_path, monkeypatch):
    append = Journal.append

    def append_and_interrupt(self, record):
        written = append(self, record)
        if len(self.records) == 5:
            os.kill(os.getpid(), signal.SIGINT)
        return written

    with monkeypatch.context() as patched:
        patched.setattr(Journal, "append", append_and_interrupt)
        code, out, err = ask(model="oracle,blind")
    assert code == 130
    assert "stopped, 1 run(s) not begun; run the same command to continue" in err
    assert [line.split()[0] for line in out.splitlines() if " nieh_gt " in line] == ["oracle"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["oracle"]
    code, _, err = ask(model="oracle,blind")
    assert code == 0
    assert "oracle: 0 evaluated now, 5 resumed" in err
    assert "blind: 5 evaluated now" in err
