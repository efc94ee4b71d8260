import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import Journal, UnitRecord, read_journal

IDENTITY = {"model": {"name": "m"}, "seed": 0}


def record(question_id="q1", fingerprint="f", reply="mug", **changes):
    fields = {
        "task": "t",
        "question_id": question_id,
        "fingerprint": fingerprint,
        "traj_id": "traj",
        "question": "?",
        "question_type": "",
        "n_clues": 1,
        "answers": ("mug",),
        "reply": reply,
    }
    return UnitRecord(**{**fields, **changes})


def test_what_was_recorded_is_there_when_the_run_goes_on(tmp_path):
    path = tmp_path / "run" / "journal.jsonl"
    with Journal(path, IDENTITY) as journal:
        journal.append(record())
    with Journal(path, IDENTITY) as journal:
        assert journal.answered(("t", "q1", ""), "f") == record()
        assert journal.answered(("t", "q1", ""), "other inputs") is None
        assert journal.answered(("other task", "q1", ""), "f") is None
    assert read_journal(path) == (IDENTITY, [record()])


@given(cut=st.integers(min_value=0))
def test_wherever_a_kill_cuts_the_file_whole_records_survive(tmp_path_factory, cut):
    path = tmp_path_factory.mktemp("journal") / "journal.jsonl"
    records = [record(f"q{number}", reply="é" * number) for number in range(4)]
    with Journal(path, IDENTITY) as journal:
        for item in records:
            journal.append(item)
    content = path.read_bytes()
    path.write_bytes(content[: cut % (len(content) + 1)])
    n_whole = max(0, path.read_bytes().count(b"\n") - 1)
    with Journal(path, IDENTITY) as journal:
        assert journal.records == records[:n_whole]
        journal.append(record("new"))
    assert read_journal(path) == (IDENTITY, [*records[:n_whole], record("new")])


def test_a_failed_unit_is_tried_again_and_its_later_reply_counts(tmp_path):
    path = tmp_path / "journal.jsonl"
    failed = record(reply=None, failure="too long", fingerprint="")
    with Journal(path, IDENTITY) as journal:
        journal.append(failed)
        assert journal.answered(("t", "q1", ""), "") is None
        journal.append(record())
        assert journal.records == [record()]
    assert read_journal(path)[1] == [record()]


def test_two_processes_cannot_write_one_journal(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path, IDENTITY), pytest.raises(UsageError, match="another run is writing it"):
        Journal(path, IDENTITY)


def test_the_journal_of_another_run_is_refused(tmp_path):
    path = tmp_path / "journal.jsonl"
    Journal(path, IDENTITY).__exit__(None, None, None)
    with pytest.raises(DataError, match="journal of another run"):
        Journal(path, {**IDENTITY, "seed": 1})


def test_a_damaged_line_is_named(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path, IDENTITY) as journal:
        journal.append(record())
    path.write_bytes(path.read_bytes() + b'{"task": 1}\n')
    with pytest.raises(DataError, match="line 3: not a line of a journal"):
        read_journal(path)
    path.write_bytes(msgspec.json.encode({"format": 99, "identity": {}}) + b"\n")
    with pytest.raises(DataError, match="format 99 of another version"):
        read_journal(path)
