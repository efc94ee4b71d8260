"""Bars on a terminal, lines elsewhere."""

import io

import pytest

from infthor_eval.cli.progress import bar
from infthor_eval.cli.progress.bar import JobBar
from infthor_eval.generation.simulator_jobs import JobProgress
from infthor_eval.terminal import PlainConsole, progress_bar


@pytest.fixture
def clock(monkeypatch):
    """The seconds that the bars see; a test moves them."""
    now = [0.0]
    monkeypatch.setattr(bar.time, "monotonic", lambda: now[0])
    return now


def test_a_job_prints_rate_time_left_and_what_is_refused(clock):
    written = io.StringIO()
    with progress_bar(PlainConsole(file=written, width=200)) as progress:
        jobs = JobBar(progress)
        for second in range(0, 41, 10):
            clock[0] = float(second)
            jobs.show(
                JobProgress("kitchen-1-seed0", 3 * second, 300, "2 task(s) refused, 2 as no plan")
            )
    assert written.getvalue().splitlines() == [
        f"kitchen-1-seed0: {3 * second} of 300 ({second} %), {100.0 - second} s left, "
        "3.0 a second; 2 task(s) refused, 2 as no plan"
        for second in (10, 20, 30, 40)
    ]


def test_the_next_job_begins_anew_and_one_may_go_back(clock):
    written = io.StringIO()
    with progress_bar(PlainConsole(file=written, width=200)) as progress:
        jobs = JobBar(progress)
        clock[0] = 100.0
        jobs.show(JobProgress("a", 100, 100))
        clock[0] = 110.0
        jobs.show(JobProgress("b", 50, 100))
        clock[0] = 171.0
        jobs.show(JobProgress("b", 20, 100))  # it dropped its last sub-goals
    assert [line.split(",")[0] for line in written.getvalue().splitlines()] == [
        "b: 50 of 100 (50 %)",
        "b: 20 of 100 (20 %)",
    ]


def test_on_a_terminal_a_bar_is_below_that_of_all_jobs(clock):
    written = io.StringIO()
    with progress_bar(PlainConsole(file=written, width=120, force_terminal=True)) as progress:
        bar.PacedBar(progress, "generate", 3)
        jobs = JobBar(progress)
        clock[0] = 2.0
        jobs.show(JobProgress("kitchen-1-seed0", 30, 300))
        progress.refresh()
        assert [task.description for task in progress.tasks] == [
            "generate",
            "kitchen-1-seed0  18.0 s left, 15.0 a second",
        ]
        assert [(task.completed, task.total) for task in progress.tasks] == [(0, 3), (30, 300)]
