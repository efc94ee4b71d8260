"""What is shown of a run as it goes is what its journal holds by then, and the run does not
notice."""

from pathlib import Path

import msgspec
import pytest

from infthor_eval.report.live.state import LiveRun
from infthor_eval.runs.journals import journal as journals
from infthor_eval.runs.journals.following import is_written
from tests.helpers.command_line import option_words
from tests.helpers.nieh_runs import make_record

from .conftest import N_UNITS

needs_locks = pytest.mark.skipif(
    not Path("/proc/locks").is_file(), reason="this system has no list of locks"
)


def folder_of(path: Path) -> Path:
    return path / "results" / "m" / "nieh-1"


def test_a_run_that_has_not_started_is_waited_for(live, tmp_path, open_journal) -> None:
    state = live.state()
    assert (state.status, state.folder) == ("waiting", str(tmp_path / "results"))
    assert state.totals.n_done == 0
    (tmp_path / "results" / "m").mkdir(parents=True)
    assert live.state().status == "waiting"
    with open_journal():
        state = live.state()
    assert (state.folder, state.name, state.n_units) == (str(folder_of(tmp_path)), "m", N_UNITS)


@needs_locks
def test_what_is_appended_is_seen_and_summed_up(live, open_journal) -> None:
    with open_journal() as journal:
        journal.append(make_record(0, "Sofa", ("Sofa",)))
        first = live.state()
        journal.append(make_record(1, "Bed", ("Sofa",)))
        journal.append(make_record(2, None, ("Bed",), failure="m fails"))
        live._metrics_due = 0.0  # a moment later
        second = live.state()
    assert (first.status, first.totals.n_done, [sample.reply for sample in first.newest]) == (
        "running",
        1,
        ["Sofa"],
    )
    assert second.totals.n_done == 3
    assert [sample.outcome for sample in second.newest] == ["failed", "wrong", "right"]
    assert [(sample.id, sample.reason) for sample in second.failures] == [("q2", "m fails")]
    assert second.totals.reasons == (("m fails", 1),)
    (rate,) = second.metrics.values()
    assert (rate.mean, rate.n, rate.n_all) == (0.5, 2, 8)


def test_the_metrics_at_the_end_are_those_of_the_results(run_cli, tmp_path, make_nieh_set) -> None:
    words = option_words(
        model="blind", tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path / "out"
    )
    assert run_cli(*words)[0] == 0
    state = LiveRun(tmp_path / "out").state()
    (results,) = (tmp_path / "out").rglob("results.json")
    stored = msgspec.json.decode(results.read_bytes())["primary_metrics"]
    assert msgspec.to_builtins(state.metrics) == stored
    assert (state.status, state.n_units, state.totals.n_done) == ("done", 5, 5)


def test_a_half_written_line_is_left_for_later(live, begun, tmp_path) -> None:
    shard = folder_of(tmp_path) / "journal" / "worker-0.jsonl"
    whole = shard.read_bytes()
    line = msgspec.json.encode(make_record(1, "Bed", ("Sofa",)))
    for end in (0, 1, len(line) // 2, len(line)):
        shard.write_bytes(whole + line[:end])
        state = live.state()
        assert (state.totals.n_done, state.problem) == (1, "")
    shard.write_bytes(whole + line + b"\n")
    assert live.state().totals.n_done == 2


@pytest.mark.parametrize("length", [0, 10])
def test_a_header_that_is_not_whole_is_a_run_that_has_not_started(
    live, open_journal, tmp_path, length: int
) -> None:
    with open_journal():
        pass
    shard = folder_of(tmp_path) / "journal" / "worker-0.jsonl"
    header = shard.read_bytes()
    shard.write_bytes(header[:length])
    assert (live.state().status, live.state().problem) == ("waiting", "")
    shard.write_bytes(header)
    assert live.state().name == "m"


@needs_locks
def test_a_killed_run_is_not_called_running(live, open_journal) -> None:
    with open_journal() as journal:
        journal.append(make_record(0, "Sofa", ("Sofa",)))
        assert live.state().status == "running"
    state = live.state()  # no lock, and no results
    assert (state.status, state.totals.n_done) == ("ended", 1)
    with open_journal():
        assert live.state().status == "running"  # gone on


def test_a_stopped_run_is_called_stopped(live, begun, tmp_path) -> None:
    (folder_of(tmp_path) / "results.json").write_text('{"n_missing": 7, "primary_metrics": {}}')
    assert live.state().status == "stopped"


def test_all_workers_shards_are_read(live, open_journal) -> None:
    with open_journal() as first, open_journal(worker=1) as second:
        first.append(make_record(0, "Sofa", ("Sofa",)))
        assert live.state().totals.n_done == 1
        second.append(make_record(1, "Sofa", ("Sofa",)))
        first.append(make_record(2, "Sofa", ("Sofa",)))
        state = live.state()
    assert state.totals.n_done == 3
    assert {sample.id for sample in state.newest} == {"q0", "q1", "q2"}


def test_a_unit_that_is_tried_again_is_counted_once(live, open_journal) -> None:
    with open_journal() as journal:
        journal.append(make_record(0, None, ("Sofa",), failure="m fails"))
        assert live.state().totals.n_failed == 1
        journal.append(make_record(0, "Sofa", ("Sofa",)))
        state = live.state()
    assert (state.totals.n_done, state.totals.n_failed, state.failures) == (1, 0, ())


def test_a_run_that_starts_again_is_read_again(live, open_journal, tmp_path) -> None:
    with open_journal() as journal:
        for number in range(3):
            journal.append(make_record(number, "Sofa", ("Sofa",)))
    assert live.state().totals.n_done == 3
    journals.set_aside(folder_of(tmp_path))  # --fresh
    with open_journal() as journal:
        journal.append(make_record(0, "Bed", ("Sofa",)))
        state = live.state()
    assert (state.totals.n_done, [sample.reply for sample in state.newest]) == (1, ["Bed"])


def test_a_bad_line_is_told_in_one_line(live, begun, tmp_path) -> None:
    shard = folder_of(tmp_path) / "journal" / "worker-0.jsonl"
    shard.write_bytes(shard.read_bytes() + b"no record\n")
    for _ in range(2):
        state = live.state()
        assert "worker-0.jsonl, line 3: not a line of a journal" in state.problem
        assert (state.totals.n_done, state.newest[0].reply) == (1, "Sofa")


def test_watching_leaves_the_folder_as_it_was_and_holds_no_lock(
    live, begun, open_journal, tmp_path
) -> None:
    paths = sorted((tmp_path / "results").rglob("*"))
    before = [
        (path, path.stat().st_mtime_ns, path.is_file() and path.read_bytes()) for path in paths
    ]
    for path in (*paths, tmp_path / "results"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    try:
        assert live.state().totals.n_done == 1
    finally:
        for path in (tmp_path / "results", *paths):
            path.chmod(0o755 if path.is_dir() else 0o644)
    after = [
        (path, path.stat().st_mtime_ns, path.is_file() and path.read_bytes()) for path in paths
    ]
    assert after == before
    assert not is_written(folder_of(tmp_path))
    with open_journal():  # refused if somebody holds it
        pass


def test_long_texts_are_cut(live, open_journal) -> None:
    with open_journal() as journal:
        journal.append(make_record(0, "x" * 100_000, ("Sofa",)))
    (sample,) = live.state().newest
    assert len(sample.reply) == 2001


def test_a_run_that_is_moved_away_is_waited_for(live, begun, tmp_path) -> None:
    assert live.state().totals.n_done == 1
    (tmp_path / "results").rename(tmp_path / "elsewhere")
    assert (live.state().status, live.state().totals.n_done) == ("waiting", 0)
    (tmp_path / "elsewhere").rename(tmp_path / "results")
    assert (live.state().totals.n_done, live.state().problem) == (1, "")


def test_what_the_system_refuses_is_told_in_one_line(live, begun, tmp_path, monkeypatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    state = live.state()
    assert state.status == "unknown"
    assert state.problem.endswith("cannot be read (Permission denied); restore it")
