import threading

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import (
    RecordTypes,
    RunConfig,
    RunHeader,
    StoredRequest,
    Tokens,
    Unit,
    UnitKey,
    UnitRecord,
    read_header,
    read_run,
)
from infthor_eval.runs.journals.journal import Journal, recover, set_aside
from infthor_eval.runs.journals.record_encoder import RefusedRecordError
from infthor_eval.runs.journals.shards import read_run_log


class Answer(msgspec.Struct, frozen=True, tag_field="type", tag="answer"):
    reply: str | None = None


class Note(msgspec.Struct, frozen=True, tag_field="type", tag="note"):
    text: str


TYPES = RecordTypes(Answer, Note)
HEADER = RunHeader(suite="toy", name="m", config=RunConfig(model={"name": "m"}, seed=0))


def record(name="q1", fingerprint="f", reply="mug", **changes):
    return UnitRecord(
        **{
            "task": "t",
            "id": name,
            "cluster": "c",
            "fingerprint": fingerprint,
            "payload": Answer(reply),
            **changes,
        }
    )


def unit(name="q1", task="t"):
    return Unit(UnitKey(task, name), "c", Answer())


def opened(run, header=HEADER, worker=0):
    return Journal(run, header, TYPES, worker)


def shard(run, worker=0):
    return run / "journal" / f"worker-{worker}.jsonl"


def test_what_was_recorded_is_there_when_the_run_goes_on(tmp_path):
    with opened(tmp_path) as journal:
        journal.append(record())
        journal.cache_artifact("inputs", Note("a mug"))
    with opened(tmp_path) as journal:
        assert journal.find_record(unit(), "f") == record()
        assert journal.find_record(unit(), "other inputs") is None
        assert journal.find_record(unit(task="other task"), "f") is None
        assert journal.find_artifact("inputs", Note) == Note("a mug")
        assert journal.find_artifact("others", Note) is None
    assert read_run(tmp_path, TYPES) == (HEADER, [record()])
    assert read_header(tmp_path) == HEADER


@given(cut=st.integers(min_value=0))
def test_wherever_a_kill_cuts_the_file_whole_records_survive(tmp_path_factory, cut):
    run = tmp_path_factory.mktemp("run")
    records = [record(f"q{number}", reply="é" * number) for number in range(4)]
    with opened(run) as journal:
        for item in records:
            journal.append(item)
    content = shard(run).read_bytes()
    shard(run).write_bytes(content[: cut % (len(content) + 1)])
    n_whole = max(0, shard(run).read_bytes().count(b"\n") - 1)
    with opened(run) as journal:
        assert journal.records == records[:n_whole]
        journal.append(record("s"))
    assert read_run(run, TYPES) == (HEADER, [*records[:n_whole], record("s")])


def test_a_failed_unit_is_tried_again_and_its_later_result_counts(tmp_path):
    with opened(tmp_path) as journal:
        journal.append(record(reply=None, failure="too long", fingerprint=""))
        assert journal.find_record(unit(), "") is None
        journal.append(record())
        assert journal.records == [record(attempt=2)]
    assert read_run(tmp_path, TYPES)[1] == [record(attempt=2)]


def test_shards_of_several_workers_are_read_together_and_the_last_attempt_counts(tmp_path):
    with opened(tmp_path, worker=0) as journal:
        journal.append(record("q1", reply=None, failure="lost"))
        journal.append(record("q2"))
    with opened(tmp_path, worker=1) as other:
        assert other.find_record(unit("q2"), "f") == record("q2")
        other.append(record("q1"))
        other.append(record("q3"))
    with opened(tmp_path, worker=0) as journal:  # read again in the other order
        assert journal.records == [record("q1", attempt=2), record("q2"), record("q3")]
    assert [item.id for item in read_run(tmp_path, TYPES)[1]] == ["q1", "q2", "q3"]


def test_of_two_workers_at_one_unit_the_one_with_a_result_counts(tmp_path):
    with opened(tmp_path, worker=0) as first, opened(tmp_path, worker=1) as second:
        first.append(record())
        second.append(record(reply=None, failure="lost"))
    assert read_run(tmp_path, TYPES)[1] == [record()]


def test_two_processes_cannot_write_one_shard(tmp_path):
    with opened(tmp_path), pytest.raises(UsageError, match="another run is writing it"):
        opened(tmp_path)


def test_the_journal_of_another_run_is_refused(tmp_path):
    opened(tmp_path).__exit__(None, None, None)
    other = RunHeader(suite="toy", name="m", config=RunConfig(seed=1))
    for worker in (0, 1):
        with pytest.raises(DataError, match="journal of another run"):
            opened(tmp_path, other, worker)


@pytest.mark.parametrize(
    "line",
    [
        b'{"type":"unit","task":1}',
        b'{"type":"episode"}',
        b"\xff\xfe",
        b'{"task": "t"}',
        b"",
        b'{"type":"unit"',
    ],
)
def test_a_bad_line_is_named_with_its_number_and_a_way_on_and_costs_its_own_unit_alone(
    tmp_path, line
):
    with opened(tmp_path) as journal:
        journal.append(record("q1"))
        journal.append(record("q2"))
        journal.cache_artifact("inputs", Note("a mug"))
    lines = shard(tmp_path).read_bytes().splitlines()
    lines[1] = line
    shard(tmp_path).write_bytes(b"\n".join(lines) + b"\n")
    for read in (lambda: opened(tmp_path), lambda: read_run(tmp_path, TYPES)):
        with pytest.raises(
            DataError, match=r"worker-0\.jsonl, line 2: not a line of a journal .*--recover"
        ):
            read()
    told = []
    assert read_run(tmp_path, TYPES, told.append) == (HEADER, [record("q2")])
    (message,) = told
    assert message.startswith(f"left out: {shard(tmp_path)}, line 2: ")
    assert recover(tmp_path, HEADER, TYPES) == 1
    with opened(tmp_path) as journal:
        assert journal.records == [record("q2")]
        assert journal.find_artifact("inputs", Note) == Note("a mug")
    assert (tmp_path / "journal" / "bad_lines.txt").read_bytes() == line + b"\n"
    assert recover(tmp_path, HEADER, TYPES) == 0


def test_a_record_that_cannot_be_kept_leaves_the_journal_as_it_was(tmp_path):
    with opened(tmp_path) as journal:
        before = shard(tmp_path).read_bytes()
        for bad in (
            record(seconds=float("nan")),
            record(seconds=-1.0),
            record(reply="\ud800"),
            record(reply=b"mug"),
            record(repeat=True),
            record(tokens=Tokens(reply=2**53 + 1)),
        ):
            with pytest.raises(RefusedRecordError, match="the record cannot be kept") as error:
                journal.append(bad)
            assert "\n" not in str(error.value)
        with pytest.raises(RefusedRecordError, match="read as"):
            journal.cache_artifact("inputs", Note(b"a mug"))
        assert journal.records == []
    assert shard(tmp_path).read_bytes() == before


def test_what_a_reader_would_refuse_for_its_size_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setenv("INFTHOR_EVAL_MAX_LINE_MB", "1")
    monkeypatch.setenv("INFTHOR_EVAL_MAX_FILE_MB", "2")
    with opened(tmp_path) as journal:
        with pytest.raises(RefusedRecordError, match="longer than 1 MiB"):
            journal.append(record(reply="x" * 2**20))
        for number in (1, 2):
            journal.append(record(f"q{number}", reply="x" * 900_000))
        with pytest.raises(DataError, match="holds 2 MiB, the most"):
            journal.append(record("q3", reply="x" * 900_000))
    assert len(read_run(tmp_path, TYPES)[1]) == 2


def test_a_bad_first_line_is_made_anew(tmp_path):
    with opened(tmp_path) as journal:
        journal.append(record())
    lines = shard(tmp_path).read_bytes().splitlines()
    shard(tmp_path).write_bytes(b"x" + b"\n".join(lines) + b"\n")
    with pytest.raises(DataError, match="line 1: not the first line of a journal"):
        opened(tmp_path)
    assert recover(tmp_path, HEADER, TYPES) == 1
    assert read_run(tmp_path, TYPES) == (HEADER, [record()])


def test_a_file_that_is_no_journal_is_left_as_it_is(tmp_path):
    shard(tmp_path).parent.mkdir()
    shard(tmp_path).write_text("my diary\nhalf a li")
    with pytest.raises(DataError, match="line 1"):
        opened(tmp_path)
    assert shard(tmp_path).read_text() == "my diary\nhalf a li"


def test_journals_of_other_formats_are_refused_in_one_line(tmp_path):
    (tmp_path / "journal.jsonl").write_text('{"format":1,"identity":{}}\n')
    with pytest.raises(DataError, match="journal is of format 1, this version reads 3") as caught:
        read_header(tmp_path)
    assert "\n" not in str(caught.value)
    with pytest.raises(DataError, match="no such folder"):
        read_header(tmp_path / "nowhere")
    shard(tmp_path).parent.mkdir()
    for version in (2, 99):
        shard(tmp_path).write_text(f'{{"type":"run","format":{version}}}\n')
        with pytest.raises(
            DataError,
            match=f"format {version}, this version reads 3; run the command again with --fresh",
        ):
            opened(tmp_path)


def test_a_journal_of_another_format_is_not_taken_for_a_damaged_one(tmp_path):
    opened(tmp_path).__exit__(None, None, None)
    old = (
        b'{"type":"run","format":2,"identity":{}}\n{"type":"memo","fingerprint":"f","payload":{}}\n'
    )
    shard(tmp_path).write_bytes(old)
    with pytest.raises(
        DataError, match="format 2, this version reads 3; run the command again with --fresh"
    ):
        recover(tmp_path, HEADER, TYPES)
    assert shard(tmp_path).read_bytes() == old
    set_aside(tmp_path)
    opened(tmp_path).__exit__(None, None, None)
    assert read_header(tmp_path) == HEADER


def test_an_earlier_journal_is_kept_under_another_name(tmp_path):
    for number in (1, 2):
        opened(tmp_path).__exit__(None, None, None)
        set_aside(tmp_path)
        assert (tmp_path / f"journal.{number}" / "worker-0.jsonl").is_file()
    set_aside(tmp_path)
    assert not (tmp_path / "journal.3").exists()


def test_a_journal_that_is_being_written_is_not_set_aside_nor_mended(tmp_path):
    with opened(tmp_path):
        for change in (set_aside, lambda run: recover(run, HEADER, TYPES)):
            with pytest.raises(UsageError, match="another run is writing it"):
                change(tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "run").write_text("a file")
    with pytest.raises(UsageError, match="cannot be written"):
        opened(tmp_path / "run")


def test_an_artifact_is_known_as_soon_as_it_is_cached(tmp_path):
    with opened(tmp_path) as journal:
        journal.cache_artifact("inputs", Note("a mug"))
        assert journal.find_artifact("inputs", Note) == Note("a mug")
        assert [artifact.payload for artifact in journal.artifacts] == [Note("a mug")]


def test_a_worker_s_record_is_written_here_only_where_its_shard_cannot_be_seen(tmp_path):
    with opened(tmp_path) as driver:
        before = shard(tmp_path).read_bytes()
        sent = StoredRequest(("Where is it?",))
        driver.add_from(7, record("unseen", request=sent.fingerprint), sent)
        assert shard(tmp_path).read_bytes().count(b"\n") == before.count(b"\n") + 2
        with opened(tmp_path, worker=1) as worker:
            worker.append(record("seen"))
        driver.add_from(1, record("seen"), None)
        assert shard(tmp_path).read_bytes().count(b"\n") == before.count(b"\n") + 2
        assert {known.id for known in driver.records} == {"unseen", "seen"}
    _, log = read_run_log(tmp_path, TYPES)
    assert [len(log.requests_before(it.request) or ()) for it in log.records] == [0, 1]


def test_what_a_request_continues_comes_before_it_and_may_not_be_missing_or_a_circle(tmp_path):
    first = StoredRequest(("a",))
    with opened(tmp_path) as journal:
        journal.cache_artifact("first", first)
        journal.cache_artifact("second", StoredRequest(("b",), after="first"))
        journal.cache_artifact("lost", StoredRequest(("c",), after="nowhere"))
        journal.cache_artifact("self", StoredRequest(("e",), after="self"))
    _, log = read_run_log(tmp_path, TYPES)
    assert log.requests_before("second") == [first, StoredRequest(("b",), after="first")]
    assert log.requests_before("lost") is None
    assert log.requests_before("self") == [StoredRequest(("e",), after="self")]


def test_what_a_lost_worker_wrote_is_read_again(tmp_path):
    with opened(tmp_path) as driver:
        with opened(tmp_path, worker=1) as worker:
            worker.append(record())
        assert driver.records == []
        driver.reread(1)
        assert driver.records == [record()]
        driver.reread(2)  # it never wrote


def test_a_worker_waits_for_one_that_is_still_ending(tmp_path):
    ending = opened(tmp_path, worker=1)
    with pytest.raises(UsageError, match="another run is writing it"):
        opened(tmp_path, worker=1)
    threading.Timer(0.3, ending.__exit__, (None, None, None)).start()
    with Journal(tmp_path, HEADER, TYPES, worker=1, wait_s=600.0) as journal:
        journal.append(record())
    assert read_run(tmp_path, TYPES)[1] == [record()]


def test_a_record_of_a_task_that_the_header_lacks_is_a_bad_line(tmp_path):
    config = RunConfig(model={"name": "m"}, seed=0, tasks={"t": {}})
    header = msgspec.structs.replace(HEADER, config=config)
    with opened(tmp_path, header) as journal:
        journal.append(record())
        journal.append(record("q2", task="another"))
    with pytest.raises(DataError, match="line 3: of a task that the run's header lacks"):
        read_run(tmp_path, TYPES)
    told = []
    assert [it.id for it in read_run(tmp_path, TYPES, told.append)[1]] == ["q1"]
    assert len(told) == 1
    with pytest.raises(DataError, match="--recover"):
        opened(tmp_path, header)
    assert recover(tmp_path, header, TYPES) == 1
    with opened(tmp_path, header) as journal:
        assert [it.id for it in journal.records] == ["q1"]
