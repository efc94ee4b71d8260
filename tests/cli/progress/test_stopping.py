"""Ctrl-C while one call computes: said after a second, and the second press ends the program."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from infthor_eval.cli.progress.stopping import answer_ctrl_c, handle_signal

STUCK_S = 2.0  # twice as long as an answer takes


@contextmanager
def one_long_call():
    """Within it the main thread handles no signal, as in a call that computes."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # another thread receives it
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def press(*after):
    """Press Ctrl-C after so many seconds each, from another thread."""
    for seconds in after:
        threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()


@pytest.fixture
def said():
    """What was said, and the presses that were handled, in order."""
    said = []
    with (
        handle_signal(signal.SIGINT, lambda *_: said.append("handled")),
        answer_ctrl_c(lambda: said.append("told"), lambda: said.append("ended")),
    ):
        yield said


def test_a_press_that_is_handled_needs_no_word(said):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(STUCK_S)
    assert said == ["handled"]


def test_a_press_in_a_long_call_is_answered_once_and_handled_after_it(said):
    with one_long_call():
        press(0.1)
        time.sleep(STUCK_S)
    assert said == ["told", "handled"]
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(STUCK_S)
    assert said == ["told", "handled", "handled"]


@pytest.mark.parametrize(
    ("second", "answers"), [(0.6, ["ended"]), (1.6, ["told", "ended"])], ids=["soon", "later"]
)
def test_a_second_press_in_the_same_call_ends_the_program(said, second, answers):
    with one_long_call():
        press(0.1, second)
        time.sleep(STUCK_S)
    assert said == [*answers, "handled"]  # the last by this process, which goes on here


def test_one_press_that_two_processes_tell_of_is_one(said):
    with one_long_call():
        press(0.1, 0.12)
        time.sleep(STUCK_S)
    assert said == ["told", "handled"]


MODEL = """
import hashlib
from pathlib import Path

def answer(images, text):
    Path("begun").touch()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)  # one call of half an hour
    return "yes"
"""


def test_a_run_in_one_long_call_ends_at_the_second_press(tmp_path):
    (tmp_path / "my.py").write_text(MODEL)
    command = ["--model", "my.py:answer", "--tasks", "nieh_mini_gt", "--limit", "2"]
    with subprocess.Popen(
        [Path(sys.executable).with_name("infthor-eval"), *command],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    ) as run:
        while not (tmp_path / "begun").exists():
            assert run.poll() is None, run.stderr.read()
            time.sleep(0.05)
        run.send_signal(signal.SIGINT)
        for line in run.stderr:
            if "press Ctrl-C again to end the program now" in line:
                break
        run.send_signal(signal.SIGINT)
        assert "stopped; run the same command to continue" in run.stderr.read()
        assert run.wait(60) == 130
