"""Jobs shared out to processes and to Ray actors: each done, whoever dies, refuses or raises."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from infthor_eval.errors import DataError, InfthorError, ModelError, UsageError
from infthor_eval.workers import (
    JobFailed,
    JobResult,
    Pool,
    WorkerLost,
    WorkerLostError,
    WorkerSettings,
    WorkerWithdrawn,
    run_jobs,
)

from ..helpers.clusters import two_nodes
from ..helpers.waiting import wait_until
from .toys import Job, OpenCounter, broken


@pytest.fixture(scope="module")
def cluster():
    """For all tests but the one that takes a node away, which comes last."""
    with two_nodes() as (started, _):
        yield started


@pytest.fixture(params=["processes", "ray"])
def pool(request):
    """Makes pools, of processes and of actors on two nodes."""
    pools = []

    def make(opening=None, count=2, **more):
        address = request.getfixturevalue("cluster").address if request.param == "ray" else None
        connect = WorkerSettings(count, address).connect(opening or OpenCounter())
        pools.append(Pool(connect, count, **more))
        return pools[-1]

    yield make
    for item in pools:
        item.close()


def counts(events, job):
    return [
        event.result[1] for event in events if isinstance(event, JobResult) and event.job == job
    ]


def of(events, kind):
    return [event for event in events if isinstance(event, kind)]


def test_every_job_is_done_once_and_in_its_order_by_all_workers(pool, tmp_path):
    meeting = tmp_path / "meeting"
    meeting.mkdir()
    shared = pool()
    shared.open()
    events = list(shared.run(6, lambda job: Job(job + 1, meets=meeting)))
    assert [counts(events, job) for job in range(6)] == [list(range(job + 1)) for job in range(6)]
    assert len({event.result[0] for event in events}) == 2
    assert {event.worker for event in events} == {1, 2}


def test_a_job_whose_worker_dies_goes_to_another_and_loses_only_what_had_not_come(pool, tmp_path):
    shared = pool()
    shared.open()
    jobs = [Job(3), Job(4, dies=2, once=tmp_path / "died"), Job(2)]
    events = list(shared.run(3, jobs.__getitem__))
    (lost,) = of(events, WorkerLost)
    assert (lost.job, "worker" in lost.reason) == (1, True)
    # What was sent may die with it.
    assert counts(events, 1) in ([0, 1, 0, 1, 2, 3], [0, 0, 1, 2, 3], [0, 1, 2, 3])
    assert (counts(events, 0), counts(events, 2)) == ([0, 1, 2], [0, 1])


def test_a_job_that_kills_one_worker_after_the_other_is_given_up_and_the_others_are_done(pool):
    shared = pool()
    shared.open()
    jobs = [Job(3, dies=0), Job(2), Job(2)]
    events = list(shared.run(3, jobs.__getitem__))
    assert [event.job for event in of(events, JobFailed)] == [0]
    assert len(of(events, WorkerLost)) == 2
    assert (counts(events, 1), counts(events, 2)) == ([0, 1], [0, 1])


@pytest.mark.parametrize(
    ("error", "kind", "expected"),
    [
        (broken(), DataError, "the abacus is broken; buy another"),
        (OSError(28, "No space left on device", "shard"), OSError, "No space left on device"),
        (MemoryError("all of it"), MemoryError, "all of it"),
        (
            ZeroDivisionError("of its own"),
            InfthorError,
            r"ZeroDivisionError in toys.py:\d+ \(do\): of its own; fix",
        ),
    ],
)
def test_what_a_worker_raises_is_raised(pool, error, kind, expected):
    shared = pool(count=1)
    shared.open()
    with pytest.raises(kind, match=expected):
        list(shared.run(1, lambda _: Job(1, raises=error)))


@pytest.mark.parametrize("opening", [OpenCounter(refusing=(2,)), OpenCounter(dying=(2,))])
def test_a_worker_that_cannot_be_made_is_told_and_the_others_do_the_work(pool, opening):
    shared = pool(opening)
    shared.open()
    events = []
    for event in shared.run(200, lambda _: Job(1, slow=0.05)):
        events.append(event)
        if of(events, WorkerWithdrawn) and of(events, JobResult):
            break
    (withdrawn,) = of(events, WorkerWithdrawn)
    assert withdrawn.worker == 2
    assert {event.worker for event in of(events, JobResult)} == {1}


def test_where_no_worker_can_be_made_the_reason_is_raised(pool):
    with pytest.raises(ModelError, match="no room for worker"):
        pool(OpenCounter(refusing=(1, 2))).open()


def test_a_worker_that_is_not_accepted_ends_the_pool(pool):
    def refuse(greeting):
        raise UsageError(f"worker {greeting['number']} is of another version")

    with pytest.raises(UsageError, match="another version"):
        pool(accept=refuse).open()


def test_once_it_is_to_stop_the_results_in_hand_are_the_last_and_further_jobs_can_be_done(pool):
    shared = pool(count=1)
    shared.open()
    events = []
    for event in shared.run(5, lambda _: Job(50, slow=0.05), lambda: bool(events)):
        events.append(event)
    assert {event.job for event in events} == {0}
    assert len(events) < 20
    assert counts(list(shared.run(1, lambda _: Job(3))), 0) == [0, 1, 2]


def test_workers_that_hear_no_signal_are_killed_together_and_soon():
    shared = Pool(WorkerSettings(3).connect(OpenCounter()), 3)
    shared.open()
    begun = {}
    for event in shared.run(3, lambda _: Job(2, stuck=1)):
        begun[event.worker] = event.result[0]
        if len(begun) == 3:
            break
    start = time.monotonic()
    shared.close()
    assert time.monotonic() - start < 10  # of one that is asked to end, and not stopped
    assert not any(map(is_running, begun.values()))


def test_processes_share_the_processors_of_the_machine(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS")
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    shared = Pool(WorkerSettings(2).connect(OpenCounter()), 2)
    assert shared.open()["threads"] == str(max(1, len(os.sched_getaffinity(0)) // 2))
    shared.close()


def test_no_process_runs_what_lies_in_the_folder_where_one_stands(tmp_path, monkeypatch):
    for name in ("pickle", "signal", "threading", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(f'{__file__} was run')")
    monkeypatch.chdir(tmp_path)
    shared = Pool(WorkerSettings(2).connect(OpenCounter()), 2)
    # What a worker's model starts looks for modules as it does without workers.
    assert shared.open()["safe path"] is None
    shared.close()
    assert "PYTHONSAFEPATH" not in os.environ


@pytest.mark.parametrize(
    ("count", "gpus", "shares"),
    [
        (2, "0,1", ["0", "1"]),
        (3, "GPU-aa, GPU-bb", ["GPU-aa", "GPU-bb", "GPU-aa"]),  # by name; two share one
        (2, "3,5,7,9", ["3,7", "5,9"]),  # a model over several
    ],
)
def test_processes_share_the_gpus_of_the_machine(count, gpus, shares, monkeypatch):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", gpus)
    connect = WorkerSettings(count).connect(OpenCounter())
    links = [connect(number) for number in range(1, count + 1)]
    assert [link.open()["gpus"] for link in links] == shares
    for link in links:
        link.close()


def test_a_driver_that_is_killed_takes_its_workers_with_it(tmp_path):
    script = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from infthor_eval.workers import Pool, WorkerSettings\n"
        "from tests.workers.toys import Job, OpenCounter\n"
        "if __name__ == '__main__':\n"
        "    pool = Pool(WorkerSettings(1).connect(OpenCounter()), 1)\n"
        "    print(pool.open()['pid'], flush=True)\n"
        "    list(pool.run(1, lambda _: Job(1000, slow=0.5)))\n"
    )
    (tmp_path / "drive.py").write_text(script)
    root = Path(__file__).parents[2]
    driver = subprocess.Popen(
        [sys.executable, tmp_path / "drive.py", root], stdout=subprocess.PIPE, text=True
    )
    worker = int(driver.stdout.readline())
    os.kill(driver.pid, signal.SIGKILL)
    driver.communicate()
    wait_until(lambda: not is_running(worker))


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(") ")[-1][0] != "Z"
    except FileNotFoundError:
        return False


def test_jobs_of_one_result_come_with_their_numbers_and_what_is_given_up_is_an_error():
    notes = []
    jobs = [Job(1), Job(1, dies=0), Job(1)]
    results = dict(run_jobs(OpenCounter(), jobs, WorkerSettings(2), notes.append))
    assert (results[0][1], results[2][1]) == (0, 0)
    assert isinstance(results[1], WorkerLostError)
    assert len(notes) == 2
    alone = dict(run_jobs(OpenCounter(), jobs[:1], WorkerSettings(1), notes.append))
    assert alone == {0: (os.getpid(), 0)}


def test_a_worker_for_which_there_is_no_room_yet_joins_when_its_node_comes():
    with two_nodes() as (cluster, second):
        cluster.remove_node(second)
        shared = Pool(WorkerSettings(2, cluster.address).connect(OpenCounter()), 2)
        shared.open()
        events = []
        for event in shared.run(400, lambda _: Job(1, slow=0.1)):
            events.append(event)
            if len(events) == 5:
                assert len({event_so_far.worker for event_so_far in events}) == 1
                cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
            if len({event_so_far.worker for event_so_far in events}) == 2:
                break
        shared.close()
    assert {event.worker for event in events} == {1, 2}
