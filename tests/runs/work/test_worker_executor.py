"""Runs by several workers: the records of one process, whoever is killed, and results of what a
stopped run had."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import msgspec
import pytest

from infthor_eval import runs
from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import execute, prepare, read_run
from infthor_eval.runs.journals.journal import Journal
from infthor_eval.workers import WorkerSettings

from ...helpers.clusters import two_nodes
from ...helpers.toy_suite import Adder, Prepared, Sum, Sums, ToySuite, make_suite
from ...helpers.waiting import wait_until
from ..toy_command import request

TWO = WorkerSettings(2)


@dataclass
class Watching:
    """Keeps what it is told."""

    seen: list = field(default_factory=list)
    notes: list = field(default_factory=list)

    def begin(self, work, n_recovered):
        self.n_units = work.n_units

    def done(self, record, resumed):
        self.seen.append((record.id, resumed))

    def notify(self, text):
        self.notes.append(text)


@dataclass
class Deadly(Sums):
    """Sums in six groups; some units kill their worker, the first so many times that they are
    begun.

    Attributes:
        folder: where it is counted.
        kills: unit to how many times.
    """

    folder: Path
    kills: dict

    @property
    def workload(self):
        groups = [
            runs.Group(
                [
                    runs.Unit(runs.UnitKey("sums", f"{a}+{b}"), f"from {a}", Sum((a, b)))
                    for b in range(4)
                ]
            )
            for a in range(6)
        ]
        return runs.Workload(groups, (), runs.RunConfig())

    def run(self, group, session):
        for unit in group.units:
            known = session.find_record(unit, "f")
            if known is None and self.kills.get(unit.key.id, 0):
                counted = self.folder / f"{unit.key.id}-{os.getpid()}"
                if len(list(self.folder.glob(f"{unit.key.id}-*"))) < self.kills[unit.key.id]:
                    counted.touch()
                    os.kill(os.getpid(), signal.SIGKILL)
            # Or one worker would be done before the other is there.
            time.sleep(0.0 if known else 0.1)
            yield known or unit.record("f", Sum(unit.payload.numbers, sum(unit.payload.numbers)))


@dataclass
class DeadlySuite(ToySuite):
    """Gives `Deadly`."""

    folder: Path
    kills: dict

    def prepare(self, run_request):
        return Prepared(partial(Deadly, self.folder, self.kills))


def run(run_request, suite, should_stop=lambda: False):
    watching = Watching()
    return execute(prepare(run_request, suite), watching, should_stop), watching


def plain(records):
    return [msgspec.structs.replace(record, attempt=1, seconds=0.0) for record in records]


def test_several_workers_find_what_one_process_finds_and_each_writes_a_shard(tmp_path):
    suite = DeadlySuite(tmp_path, {})
    alone, _ = run(request(tmp_path / "1"), suite)
    shared, watching = run(request(tmp_path / "2", worker_settings=TWO), suite)
    assert plain(shared.records) == plain(alone.records)
    assert (shared.folder.name, shared.summary) == (alone.folder.name, alone.summary)
    assert (shared.folder / "results.json").read_bytes() == (
        alone.folder / "results.json"
    ).read_bytes()
    assert (len(watching.seen), watching.n_units, watching.notes) == (24, 24, [])
    shards = [
        path.read_bytes().count(b"\n")
        for path in sorted((shared.folder / "journal").glob("*.jsonl"))
    ]
    assert (len(shards), shards[0], sum(shards)) == (3, 1, 3 + 24)
    assert list(shared.docs) == list(alone.docs)
    assert len(list(shared.docs)) == 24
    assert all(resumed for _, resumed in run(request(tmp_path / "2"), suite)[1].seen)
    assert all(
        resumed for _, resumed in run(request(tmp_path / "1", worker_settings=TWO), suite)[1].seen
    )


class Unequal(Sums):
    """Sums in six groups, each of which looks at more frames than the one before."""

    def __init__(self):
        groups = [
            runs.Group([runs.Unit(runs.UnitKey("sums", f"{n}+0"), f"from {n}", Sum((n, 0)))], n)
            for n in range(6)
        ]
        self.workload = runs.Workload(groups, (), runs.RunConfig())

    def run(self, group, session):
        for unit in group.units:
            yield session.find_record(unit, "f") or unit.record("f", Sum(unit.payload.numbers, 1))


class UnequalSuite(ToySuite):
    """Gives `Unequal`."""

    def prepare(self, run_request):
        return Prepared(Unequal)


def test_workers_begin_with_the_dearest_groups(tmp_path):
    suite = UnequalSuite()
    _, watching = run(request(tmp_path / "2", worker_settings=TWO), suite)
    assert watching.seen[0][0] in ("5+0", "4+0")
    assert watching.seen[-1][0] in ("0+0", "1+0")
    _, watching = run(request(tmp_path / "1"), suite)
    assert [name for name, _ in watching.seen] == [f"{n}+0" for n in range(6)]


class Faulty(Sums):
    """Raises in every group."""

    def run(self, group, session):
        raise ZeroDivisionError("of its own")
        yield


class FaultySuite(ToySuite):
    """Gives `Faulty`."""

    def prepare(self, run_request):
        return Prepared(Faulty)


@pytest.mark.timeout(120)
def test_tracebacks_of_workers_are_kept_too(tmp_path):
    outcome, _ = run(request(tmp_path, worker_settings=TWO), FaultySuite())
    assert len(outcome.records) == 4
    for record in outcome.records:
        assert record.failure.startswith("ZeroDivisionError in test_worker_executor.py:")
        assert record.failure.endswith("; traceback in journal/tracebacks.txt")
    text = (outcome.folder / "journal" / "tracebacks.txt").read_text()
    assert sorted(line for line in text.splitlines() if line.startswith("== ")) == [
        f"== sums: {record.id}, attempt 1" for record in outcome.records
    ]
    assert "ZeroDivisionError: of its own" in text


def test_workers_that_are_killed_lose_nothing_that_was_finished(tmp_path):
    alone, _ = run(request(tmp_path / "1"), DeadlySuite(tmp_path, {}))
    killing = DeadlySuite(tmp_path, {"0+2": 1, "3+0": 2, "5+3": 1})
    shared, watching = run(request(tmp_path / "2", worker_settings=TWO), killing)
    assert plain(shared.records) == plain(alone.records)
    assert len(watching.seen) == len({name for name, _ in watching.seen}) == 24
    assert len(watching.notes) == 4
    assert "died (exit status -9); what it had not finished goes to another" in watching.notes[0]


def test_a_unit_that_kills_every_worker_fails_and_the_others_have_results(tmp_path):
    shared, _ = run(request(tmp_path, worker_settings=TWO), DeadlySuite(tmp_path, {"2+1": 99}))
    failed = {record.id: record.failure for record in shared.records if record.failure is not None}
    assert sorted(failed) == ["2+1"]
    assert "worker after worker was lost at it (worker" in failed["2+1"]
    again, watching = run(request(tmp_path), DeadlySuite(tmp_path, {}))
    assert [record.failure for record in again.records] == [None] * 24
    assert sum(not resumed for _, resumed in watching.seen) == 1


@pytest.mark.parametrize("worker_settings", [WorkerSettings(), TWO])
def test_a_run_that_is_stopped_has_the_results_of_what_is_there_and_goes_on(
    tmp_path, worker_settings
):
    suite, watching = DeadlySuite(tmp_path, {}), Watching()
    run_ = prepare(request(tmp_path, worker_settings=worker_settings), suite)
    stopped = execute(run_, watching, lambda: len(watching.seen) >= 3)
    assert 3 <= len(stopped.records) < 24
    assert stopped.n_missing == 24 - len(stopped.records)
    assert (
        json.loads((stopped.folder / "results.json").read_text())["n_missing"] == stopped.n_missing
    )
    outcome, watching = run(request(tmp_path, worker_settings=worker_settings), suite)
    assert (outcome.n_missing, len(outcome.records)) == (0, 24)
    assert sum(resumed for _, resumed in watching.seen) == len(stopped.records)


class _Losing(Watching):
    """Takes a node away once some units are done."""

    def __init__(self, cluster, node):
        super().__init__()
        self._cluster, self._node = cluster, node

    def done(self, record, resumed):
        super().done(record, resumed)
        if len(self.seen) == 5:
            self._cluster.remove_node(self._node)


def test_a_cluster_that_loses_a_node_finds_what_one_process_finds(tmp_path):
    suite = DeadlySuite(tmp_path, {"4+1": 1})
    with two_nodes() as (cluster, node):
        watching = _Losing(cluster, node)
        run_request = request(tmp_path / "2", worker_settings=WorkerSettings(2, cluster.address))
        shared = execute(prepare(run_request, suite), watching)
    alone, _ = run(request(tmp_path / "1"), suite)
    assert plain(shared.records) == plain(alone.records)
    assert (shared.folder / "results.json").read_bytes() == (
        alone.folder / "results.json"
    ).read_bytes()
    assert len(watching.seen) == 24
    # Of the node's worker, and of the one that a unit killed; on a busy machine they are the same
    # one.
    assert watching.notes


class OtherElsewhere(Adder):
    """A subject that is another in each process."""

    def __init__(self, seed=0):
        super().__init__(seed)
        self.identity = lambda: {"baseline": "adder", "process": os.getpid()}


class OtherSuite(DeadlySuite):
    """Workers of it do not evaluate the same."""

    baselines = {"adder": OtherElsewhere}  # noqa: RUF012


def test_workers_that_would_evaluate_something_else_are_refused(tmp_path):
    with pytest.raises(UsageError, match="the workers differ in model"):
        run(request(tmp_path, worker_settings=WorkerSettings(3)), OtherSuite(tmp_path, {}))


def test_a_second_run_in_one_folder_is_refused_whatever_its_workers(tmp_path):
    outcome, _ = run(request(tmp_path), DeadlySuite(tmp_path, {}))
    with Journal(outcome.folder, outcome.summary.header, ToySuite.records):
        for worker_settings in (WorkerSettings(), TWO):
            with pytest.raises(UsageError, match="another run is writing it"):
                run(request(tmp_path, worker_settings=worker_settings), DeadlySuite(tmp_path, {}))


def test_what_a_worker_cannot_write_ends_the_run_and_what_is_written_counts(tmp_path):
    suite = DeadlySuite(tmp_path, {})
    outcome, _ = run(request(tmp_path, worker_settings=TWO), suite)
    shard = outcome.folder / "journal" / "worker-1.jsonl"
    shard.write_bytes(shard.read_bytes() + b'{"type": "unit", "broken\n')
    with pytest.raises(DataError, match=r"worker-1.jsonl, line .*--recover"):
        run(request(tmp_path, worker_settings=TWO), suite)
    assert len(run(request(tmp_path, worker_settings=TWO, recover=True), suite)[0].records) == 24


def test_records_whose_shard_is_on_another_disk_are_put_into_the_drivers(tmp_path):
    outcome, _ = run(request(tmp_path), ToySuite())
    (tmp_path / "other").mkdir()
    with Journal(tmp_path / "other", outcome.summary.header, ToySuite.records) as journal:
        journal.add_from(7, outcome.records[0], None)
    assert read_run(tmp_path / "other", ToySuite.records)[1] == outcome.records[:1]


def test_a_result_from_other_inputs_is_named_in_the_record_that_takes_its_place(tmp_path):
    class Changed(Sums):
        def run(self, group, session):
            for unit in group.units:
                yield session.find_record(unit, "g") or unit.record("g", unit.payload)

    run(request(tmp_path), ToySuite())
    records = run(request(tmp_path), make_suite(Changed))[0].records
    changed = "its inputs changed since attempt 1: a frame, a text or a trajectory is another now"
    # The others had failed.
    assert [record.faults for record in records] == [(changed,), (changed,), (), ()]


@pytest.mark.parametrize("again", [False, True])
def test_ctrl_c_finishes_the_unit_in_hand_and_shows_what_is_there_and_again_stops_at_once(
    tmp_path, again
):
    toy, gate, output = (
        Path(__file__).parents[1] / "toy_command.py",
        tmp_path / "gate",
        tmp_path / "out",
    )
    gate.mkdir()
    (gate / "open-0").touch()
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    process = subprocess.Popen(
        [sys.executable, toy, output, gate], stdout=-1, stderr=-1, text=True, env=environment
    )
    wait_until((gate / "waiting-1").exists, process)
    process.send_signal(signal.SIGINT)
    stopping = "stopping after the present unit; press Ctrl-C again to stop at once"
    assert any(stopping in line for line in process.stderr)
    if again:
        process.send_signal(signal.SIGINT)
    else:
        (gate / "open-1").touch()
    printed, error_text = process.communicate()
    assert process.returncode == (-signal.SIGINT if again else 130)
    (folder,) = (output / "adder").iterdir()
    results = json.loads((folder / "results.json").read_text())
    assert results["n_missing"] == (3 if again else 2)
    if not again:
        assert "2 not attempted; run the same command to continue" in error_text
        assert ["adder", "(incomplete)", "2"] in [line.split() for line in printed.splitlines()]
