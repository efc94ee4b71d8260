"""The driver, by the smallest suite: whatever it can do, it can do for every suite."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import DataError, Terminated
from infthor_eval.runs import UnitKey, execute, prepare, read_header, read_run
from infthor_eval.runs.journals.tracebacks import StoredTracebacks
from infthor_eval.workers import WorkerSettings
from tests.helpers.toy_suite import Sum, Sums, ToySuite, Watching, is_broken, make_suite, run
from tests.runs.toy_command import request

from ...helpers.waiting import PATIENCE_S, wait_until

TOY = Path(__file__).parents[1] / "toy_command.py"


def start(output, *arguments):
    return subprocess.Popen(
        [sys.executable, TOY, output, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )


def test_a_group_that_fails_takes_no_other_with_it_and_its_units_are_named(tmp_path):
    closed = []

    class Closing(Sums):
        def close(self):
            closed.append(self)

    outcome, watching = run(request(tmp_path), make_suite(Closing))
    assert watching.begun == (4, 1, 0)
    broken = "the abacus is broken"
    assert watching.seen == [
        ("1+3", None, False),
        ("1+4", None, False),
        ("2+3", broken, False),
        ("2+4", broken, False),
    ]
    assert outcome.summary.summary.numbers == (2, 2)
    assert [record.payload.answer for record in outcome.records] == [4, 5, None, None]
    assert read_run(outcome.folder, ToySuite.records) == (outcome.summary.header, outcome.records)
    assert len(closed) == 1
    assert [doc.reply for doc in outcome.docs] == ["4", "5", "None", "None"]
    # They can be read again.
    assert [doc.number for doc in outcome.docs] == [13, 14, 23, 24]


def broken_by(error, answered=0):
    """A suite whose second group raises when it has answered so many units."""

    class Broken(Sums):
        def run(self, group, session):
            if not is_broken(group):
                yield from super().run(group, session)
                return
            for unit in group.units[:answered]:
                yield unit.record("f", Sum(unit.payload.numbers, sum(unit.payload.numbers)))
            if error is not None:
                raise error

    return make_suite(Broken)


FAULTS = {
    "an exit": (SystemExit(0), "SystemExit in test_driver.py:", ": 0; fix the suite"),
    "an exit of a generator": (GeneratorExit(), "GeneratorExit in ", ": GeneratorExit; fix"),
    "a value": (
        ValueError("no such\nsum"),
        "ValueError in test_driver.py:",
        ": no such sum; fix the suite",
    ),
    "a key": (KeyError("sum"), "KeyError in test_driver.py:", ": no 'sum'; fix the suite"),
    "a bug": (RuntimeError(), "RuntimeError in test_driver.py:", ": RuntimeError; fix the suite"),
    "of the system": (
        OSError(5, "Input/output error"),
        "OSError in test_driver.py:",
        ": Input/output error; fix",
    ),
    "an assertion": (
        AssertionError("odd"),
        "AssertionError in test_driver.py:",
        "(run): odd; fix the suite",
    ),
    "no record": (None, "the suite gives no record of it", "; fix the suite"),
}


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("answered", [0, 1])
def test_a_programming_error_in_a_group_fails_its_units_alone_with_type_place_and_message(
    tmp_path, name, answered
):
    error, expected, why = FAULTS[name]
    outcome, watching = run(request(tmp_path), broken_by(error, answered))
    assert outcome.summary.summary.numbers == (2 + answered, 2 - answered)
    assert len(watching.seen) == 4
    for failure in (record.failure for record in outcome.records[2 + answered :]):
        assert expected in failure
        assert why in failure
        assert "\n" not in failure
    assert [resumed for _, _, resumed in run(request(tmp_path))[1].seen[:2]] == [True, True]


def test_tracebacks_are_kept_beside_the_shards_by_unit_and_attempt(tmp_path):
    first = run(request(tmp_path), broken_by(ZeroDivisionError("of its own")))[0]
    failures = [record.failure for record in first.records[2:]]
    assert [failure.endswith("; traceback in journal/tracebacks.txt") for failure in failures] == [
        True,
        True,
    ]
    file = first.folder / "journal" / "tracebacks.txt"
    once, again = file.read_text().split("== sums: ")[1:]
    assert once.startswith("2+3, attempt 1\nTraceback (most recent call last):\n")
    assert f'File "{__file__}", line ' in once
    assert "ZeroDivisionError: of its own" in once
    assert again == "2+4, attempt 1\nas for sums: 2+3, attempt 1\n\n"
    run(request(tmp_path), broken_by(ZeroDivisionError("of its own")))
    assert file.read_text().count("== sums: 2+3, attempt ") == 2
    assert "== sums: 2+4, attempt 2\nas for sums: 2+3, attempt 2\n" in file.read_text()
    stored = StoredTracebacks(first.folder / "journal")
    texts = [
        stored.find(UnitKey("sums", name), attempt) for name in ("2+3", "2+4") for attempt in (1, 2)
    ]
    assert all(text.endswith("ZeroDivisionError: of its own") for text in texts)
    assert texts[:2] == texts[2:]
    assert stored.find(UnitKey("sums", "1+3"), 1) == ""
    assert StoredTracebacks(tmp_path).find(UnitKey("sums", "2+3"), 1) == ""


def test_what_a_suite_says_itself_needs_no_traceback(tmp_path):
    outcome, _ = run(request(tmp_path))
    assert {record.failure for record in outcome.records[2:]} == {"the abacus is broken"}
    assert not (outcome.folder / "journal" / "tracebacks.txt").exists()


def test_a_record_that_cannot_be_written_fails_alone(tmp_path):
    class Odd(Sums):
        def run(self, group, session):
            for unit in group.units:
                yield unit.record("f", Sum((object(), 0)) if is_broken(group) else unit.payload)

    outcome, _ = run(request(tmp_path), make_suite(Odd))
    assert outcome.summary.summary.numbers == (2, 2)
    assert outcome.records[3].failure.startswith(
        "the record cannot be kept (Encoding objects of type object is unsupported); fix "
    )


@pytest.mark.parametrize("error", [KeyboardInterrupt, Terminated, MemoryError])
def test_what_is_no_fault_of_the_suite_ends_the_run_and_keeps_what_is_done(tmp_path, error):
    with pytest.raises(error):
        run(request(tmp_path), broken_by(error()))
    # Who stops it has the results of what is there; a machine without memory is asked for nothing
    # more.
    (folder,) = (tmp_path / "adder").iterdir()
    results = folder / "results.json"
    assert (json.loads(results.read_text())["n_missing"] if results.exists() else None) == (
        None if error is MemoryError else 2
    )
    assert [resumed for _, _, resumed in run(request(tmp_path))[1].seen[:2]] == [True, True]


def test_a_programming_error_is_counted_and_told_at_the_end(tmp_path, capfd):
    from infthor_eval.cli.commands.run import evaluate
    from infthor_eval.cli.options.show import ShowOptions

    assert (
        evaluate([(request(tmp_path), broken_by(ZeroDivisionError("of its own")))], ShowOptions())
        == 1
    )
    output, error_text = capfd.readouterr()
    assert ["adder", "(incomplete)", "2"] in [line.split() for line in output.splitlines()]
    assert (
        "sums: 2 sample(s) failed, in no score: ZeroDivisionError in test_driver.py:" in error_text
    )
    assert "Traceback" not in error_text


def test_what_is_known_is_not_done_again_and_what_failed_is_tried_again(tmp_path):
    run(request(tmp_path))
    outcome, watching = run(request(tmp_path))
    assert [resumed for _, _, resumed in watching.seen] == [True, True, False, False]
    assert [record.attempt for record in outcome.records] == [1, 1, 2, 2]


def test_what_cannot_be_closed_is_told_and_the_results_are_there(tmp_path):
    class Stuck(Sums):
        def close(self):
            raise RuntimeError("the lid is stuck")

    outcome, _ = run(request(tmp_path), make_suite(Stuck))
    assert "close() fails" in outcome.close_failure
    assert "the lid is stuck" in outcome.close_failure
    assert (outcome.folder / "results.json").is_file()
    assert run(request(tmp_path))[0].close_failure is None


def test_the_folder_has_the_command_and_the_results(tmp_path):
    outcome, _ = run(request(tmp_path))
    assert {"run.yaml", "results.json", "scores.jsonl", "usage.json"} <= {
        path.name for path in outcome.folder.iterdir()
    }


@pytest.mark.timeout(600)
def test_two_workers_have_the_results_of_one_process(tmp_path):
    alone, _ = run(request(tmp_path / "alone"))
    shared = execute(
        prepare(request(tmp_path / "shared", worker_settings=WorkerSettings(2)), ToySuite())
    )
    assert (shared.folder / "results.json").read_bytes() == (
        alone.folder / "results.json"
    ).read_bytes()
    shards = {
        path.stem: path.read_bytes() for path in (shared.folder / "journal").glob("worker-*.jsonl")
    }
    # One worker may be so quick that there is nothing left for the other; the driver (0) does no
    # unit itself.
    assert {"worker-0"} < shards.keys() <= {"worker-0", "worker-1", "worker-2"}
    assert b'"type":"unit"' not in shards["worker-0"]


def test_a_shard_that_is_deleted_after_the_last_unit_gives_no_results(tmp_path, monkeypatch):
    class Deleting(Watching):
        def done(self, record, resumed):
            super().done(record, resumed)
            if len(self.seen) == self.begun[0]:
                next((tmp_path / "adder").glob("*/journal/*.jsonl")).unlink()

    with pytest.raises(DataError, match="was deleted or replaced"):
        execute(prepare(request(tmp_path), ToySuite()), Deleting())
    assert not list((tmp_path / "adder").glob("*/results.json"))


def test_a_clock_that_goes_back_changes_nothing(tmp_path, monkeypatch):
    back = itertools.count(2_000_000_000, -3600)
    monkeypatch.setattr(time, "time", lambda: float(next(back)))
    monkeypatch.setattr(time, "time_ns", lambda: next(back) * 10**9)
    first, again = run(request(tmp_path))[0], run(request(tmp_path))[0]
    assert [record.attempt for record in again.records] == [1, 1, 2, 2]
    assert first.records[:2] == again.records[:2]
    assert all(record.seconds >= 0 for record in again.records)


def test_fresh_starts_anew_and_keeps_the_earlier_journal_aside(tmp_path):
    first, _ = run(request(tmp_path))
    _, watching = run(request(tmp_path, fresh=True))
    assert not any(resumed for _, _, resumed in watching.seen)
    assert (first.folder / "journal.1" / "worker-0.jsonl").is_file()


def test_bad_lines_are_set_aside_and_only_their_units_are_tried_again(tmp_path):
    outcome, _ = run(request(tmp_path))
    shard = outcome.folder / "journal" / "worker-0.jsonl"
    lines = shard.read_bytes().splitlines()
    lines[1] = lines[1][:30] + b"\x00" + lines[1][31:]
    shard.write_bytes(b"\n".join(lines) + b"\n")
    with pytest.raises(
        Exception, match=r"worker-0.jsonl, line 2: not a line of a journal .* --recover"
    ):
        run(request(tmp_path))
    _, watching = run(request(tmp_path, recover=True))
    assert watching.begun == (4, 1, 1)
    assert [resumed for _, _, resumed in watching.seen] == [False, True, False, False]
    assert (shard.parent / "bad_lines.txt").read_bytes() == lines[1] + b"\n"


def test_the_name_is_the_runs_own_and_changes_no_identity(tmp_path):
    plain, named = run(request(tmp_path))[0], run(request(tmp_path, name="my adder"))[0]
    assert (plain.folder.parent.name, named.folder.parent.name) == ("adder", "my adder")
    assert plain.folder.name == named.folder.name
    assert read_header(named.folder).name == "my adder"


def test_records_of_units_that_the_run_does_not_ask_are_not_counted(tmp_path):
    outcome, _ = run(request(tmp_path))
    shard = outcome.folder / "journal" / "worker-0.jsonl"
    stray = msgspec.structs.replace(outcome.records[0], id="9+9")
    shard.write_bytes(shard.read_bytes() + msgspec.json.encode(stray) + b"\n")
    assert run(request(tmp_path))[0].summary.summary.numbers == (2, 2)


def test_a_killed_command_goes_on_and_shows_progress_table_results_and_export(tmp_path):
    gate = tmp_path / "gate"
    gate.mkdir()
    (gate / "open-0").touch()
    killed = start(tmp_path, gate)
    wait_until((gate / "waiting-1").exists, killed)
    os.kill(killed.pid, signal.SIGKILL)
    killed.communicate()
    again = start(tmp_path)
    output, error_text = again.communicate(timeout=PATIENCE_S)
    assert again.returncode == 1, error_text  # a group failed
    assert "adder: 3 evaluated now, 1 resumed from the journal" in error_text
    assert "sums: 1 sample(s) skipped: nothing to add" in error_text
    assert "sums: 2 sample(s) failed, in no score: the abacus is broken" in error_text
    assert ["adder", "(incomplete)", "2"] in [line.split() for line in output.splitlines()]
    (folder,) = (tmp_path / "adder").iterdir()
    results = json.loads((folder / "results.json").read_text())
    assert (results["suite"], results["summary"]["numbers"]) == ("toy", [2, 2])
    (samples,) = folder.glob("lm_eval/adder/samples_sums_*.jsonl")
    rows = [json.loads(line) for line in samples.read_text().splitlines()]
    assert [(row["target"], row["right"]) for row in rows] == [
        ("4", 1.0),
        ("5", 1.0),
        ("5", None),
        ("6", None),
    ]
