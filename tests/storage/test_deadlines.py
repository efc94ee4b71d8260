import subprocess
import sys
import threading
import time
from contextlib import suppress

import pytest

from infthor_eval.storage.deadlines import _CLOCKS, limit_time, not_counted

SHORT_S = 0.15
LONG_S = 600.0


def _compute():
    while True:
        pass


def _compute_and_catch():
    while True:
        try:
            _compute()
        except Exception:  # noqa: BLE001 - as anybody's code does
            continue


def _wait_for_a_lock():
    lock = threading.Lock()
    lock.acquire()
    lock.acquire()


def _late(code):
    with pytest.raises(TimeoutError, match="late"), limit_time(SHORT_S, TimeoutError("late")):
        code()
    assert not _CLOCKS


def _in_thread(code):
    failures = []

    def run():
        try:
            code()
        except BaseException as error:  # noqa: BLE001 - raised again in the thread of the test
            failures.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(60.0)
    assert not thread.is_alive()
    for failure in failures:
        raise failure


@pytest.mark.parametrize("code", [_compute, _compute_and_catch])
@pytest.mark.parametrize("run", [lambda code: code(), _in_thread], ids=["main", "thread"])
def test_code_that_computes_for_ever_is_stopped(run, code):
    run(lambda: _late(code))


@pytest.mark.parametrize("code", [_wait_for_a_lock, lambda: time.sleep(LONG_S)])
def test_code_of_the_main_thread_that_waits_for_ever_is_stopped(code):
    _late(code)


@pytest.mark.parametrize("run", [lambda code: code(), _in_thread], ids=["main", "thread"])
def test_a_limit_that_is_over_interrupts_nothing_later(run):
    def code():
        for _ in range(500):  # many end just when their time is up
            with suppress(TimeoutError), limit_time(0.001, TimeoutError("late")):
                time.sleep(0.001)
        time.sleep(0.01)
        for _ in range(1000):
            pass

    run(code)


@pytest.mark.parametrize("run", [lambda code: code(), _in_thread], ids=["main", "thread"])
def test_the_outer_of_two_limits_ends_both(run):
    def code():
        with (
            pytest.raises(TimeoutError, match="outer"),
            limit_time(SHORT_S, TimeoutError("outer")),
            limit_time(LONG_S, TimeoutError("inner")),
        ):
            _compute()

    run(code)


@pytest.mark.parametrize("run", [lambda code: code(), _in_thread], ids=["main", "thread"])
def test_the_inner_of_two_limits_ends_itself_alone(run):
    def code():
        with limit_time(LONG_S, TimeoutError("outer")):
            with (
                pytest.raises(TimeoutError, match="inner"),
                limit_time(SHORT_S, TimeoutError("inner")),
            ):
                _compute()
            time.sleep(0.01)

    run(code)


def test_what_is_asked_of_us_is_not_counted():
    with limit_time(SHORT_S, TimeoutError("late")), not_counted():
        time.sleep(2 * SHORT_S)
    with pytest.raises(TimeoutError), limit_time(SHORT_S, TimeoutError("late")):
        with not_counted():
            time.sleep(SHORT_S)
        time.sleep(LONG_S)


def test_an_error_that_is_made_of_the_interruption_is_the_limits():
    with pytest.raises(TimeoutError, match="late"), limit_time(SHORT_S, TimeoutError("late")):
        try:
            _compute()
        except BaseException as error:
            raise ValueError("it fails") from error


def test_an_error_of_the_code_itself_passes():
    with pytest.raises(ValueError, match="its own"), limit_time(LONG_S, TimeoutError("late")):
        raise ValueError("its own")


@pytest.mark.parametrize("run", [lambda code: code(), _in_thread], ids=["main", "thread"])
def test_a_limit_is_cheap_as_one_thread_watches_all(run, monkeypatch):
    started = []
    start = threading.Thread.start
    run(lambda: _late(_compute))  # the watcher runs

    def count(thread):
        started.append(thread.name)
        start(thread)

    def code():
        for _ in range(2000):
            with limit_time(LONG_S, TimeoutError("late")):
                pass

    monkeypatch.setattr(threading.Thread, "start", count)
    before = time.process_time()
    code()
    assert started == []
    # 0.02 s where it was measured; a thread for each took 0.5 s.
    assert time.process_time() - before < 0.25


def test_a_limit_that_begins_later_and_ends_earlier_is_kept():
    with limit_time(LONG_S, TimeoutError("outer")):
        _late_inner()


def _late_inner():
    with pytest.raises(TimeoutError, match="late"), limit_time(SHORT_S, TimeoutError("late")):
        time.sleep(LONG_S)


def test_a_copy_of_the_process_has_a_watcher_of_its_own():
    code = (
        "import os, time\nfrom infthor_eval.storage.deadlines import limit_time\n"
        "with limit_time(600, TimeoutError('outer')):\n    pass\n"
        "if os.fork() == 0:\n"
        "    try:\n"
        "        with limit_time(0.1, TimeoutError('late')): time.sleep(600)\n"
        "    except TimeoutError:\n        os._exit(7)\n"
        "print(os.waitstatus_to_exitcode(os.wait()[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "7\n"
