"""Runs in batches that are killed again and again: nothing is asked twice, nothing is lost."""

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time

from ....helpers.command_line import option_words
from ....helpers.journals import read_outcome
from ....helpers.waiting import PATIENCE_S, wait_until
from ..talking import completion
from .server import BatchServer, serve_batches

# The pauses between two looks are those of a test, the rest is what a user starts.
CODE = """
from model_adapters.served.batches import queue
queue._FIRST_POLL_S = queue._LONGEST_POLL_S = queue._LISTED_WITHIN_S = 0.02
from infthor_eval.cli import main
main()
"""
N_KILLS = 10


def _command(server, data, output):
    model_args = f"base_url={server.url},model=m,batch=true,batch_requests=2"
    words = option_words(model="openai", model_args=model_args, tasks="nieh_gt", data=data)
    return [sys.executable, "-c", CODE, *map(str, words), "--out", str(output)]


def _start(command):
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ}
    )


def _says(body):
    """A reply that follows from the question, so that no two are confused."""
    return completion(f"yes, {body['messages'][-1]['content'][-1]['text']}"[:60])


def _replies(output):
    return {record.key: record.payload.reply for record in read_outcome(output)[0]}


def test_ten_kills_at_any_moment_change_nothing(make_nieh_set, tmp_path):
    data = make_nieh_set(size=56)
    drawn = random.Random(5)
    with serve_batches(BatchServer(answer=_says, looks=1)) as server:
        whole = _start(_command(server, data, tmp_path / "whole"))
        _, err = whole.communicate(timeout=PATIENCE_S)
        assert whole.returncode == 0, err
        expected = _replies(tmp_path / "whole")
        n_requests = sum(server.asked.values())
        server.asked.clear()

        command = _command(server, data, tmp_path / "killed")
        for n in range(N_KILLS):
            # Killed in the middle of a request: sometimes before the server has worked on it,
            # sometimes after it, before its answer is there.
            moment, before = n // 2 + 1, drawn.random() < 0.5
            _kill_at(server, command, moment, before)
        last = _start(command)
        _, err = last.communicate(timeout=PATIENCE_S)
        assert last.returncode == 0, err
    assert _replies(tmp_path / "killed") == expected
    assert sum(server.asked.values()) == n_requests == len(expected)
    assert set(server.asked.values()) == {1}


def _kill_at(server, command, moment, before):
    """Kill a run while its request of this number is under way."""
    reached = threading.Event()
    killed = threading.Event()
    n_seen = 0

    def before_request(method, path):
        nonlocal n_seen
        n_seen += 1
        if n_seen != moment:
            return None
        reached.set()
        killed.wait(PATIENCE_S)
        return (0, b"") if before else None

    server.before = before_request
    process = _start(command)
    try:
        wait_until(lambda: reached.is_set() or process.poll() is not None)
        process.send_signal(signal.SIGKILL)
        process.communicate()
    finally:
        killed.set()
        server.before = lambda *_: None


def test_ctrl_c_leaves_the_batches_to_the_server(make_nieh_set, tmp_path):
    data = make_nieh_set(size=56)
    with serve_batches(BatchServer(answer=_says, looks=10**9)) as server:
        command = _command(server, data, tmp_path / "out")
        stopped = _start(command)
        wait_until(lambda: len(server.batches) == 3, stopped)
        stopped.send_signal(signal.SIGINT)
        _, err = stopped.communicate(timeout=PATIENCE_S)
        assert stopped.returncode == 130
        assert "3 batch(es) with 5 request(s) go on at the server; the same command fetches" in err
        assert "Traceback" not in err
        for batch in server.batches.values():
            batch["looks"] = 0
        again = _start(command)
        _, err = again.communicate(timeout=PATIENCE_S)
        assert again.returncode == 0, err
        assert len(server.batches) == 3
    assert json.loads(next((tmp_path / "out").rglob("usage.json")).read_text())
    assert set(server.asked.values()) == {1}


def test_a_bundled_set_is_asked_once_however_often_the_run_is_killed(tmp_path):
    """Not at chosen requests, but after random times, on a bundled set."""
    model_args = "model=m,batch=true,batch_requests=30"
    drawn = random.Random(7)
    with serve_batches(BatchServer(answer=_says, looks=3)) as server:
        given = f"base_url={server.url},{model_args}"
        words = option_words(model="openai", model_args=given, tasks="nieh_mini_gt")
        command = [sys.executable, "-c", CODE, *words, "--out", str(tmp_path)]
        for _ in range(N_KILLS):
            _kill_after(server, command, drawn.randrange(1, 24), drawn.random() / 10)
        server.before = lambda *_: None
        last = _start(command)
        _, err = last.communicate(timeout=PATIENCE_S)
        assert last.returncode == 0, err
    assert server.n_asked == len(_replies(tmp_path)) == 127


def _kill_after(server, command, n, seconds):
    """Kill a run some time after its request of this number came, if it comes so far."""
    seen = []
    server.before = lambda _, path: seen.append(path)
    process = _start(command)
    wait_until(lambda: len(seen) >= n or process.poll() is not None)
    time.sleep(seconds)
    process.kill()
    process.communicate()
