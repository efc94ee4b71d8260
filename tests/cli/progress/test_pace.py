"""The pace of a run: in lines without a terminal, and in the bar with one."""

import io
import re

import pytest
from rich.console import Console

from infthor_eval.cli.progress.bar import PacedBar, StepBars
from infthor_eval.cli.progress.pace import Pace, format_duration
from infthor_eval.terminal import progress_bar

from ...helpers.command_line import option_words


def test_resumed_units_do_not_count_for_the_pace():
    pace = Pace(100, 0.0)
    for _ in range(40):
        pace.count(True, 5.0)
    assert pace.line(5.0) == "40 of 100 (40 %)"
    for number in range(10):
        pace.count(False, 6.0 + number, context=100, cached=80)
    assert pace.line(15.0) == "50 of 100 (50 %), 50.0 s left, 1.0 a second, 80 % of tokens cached"
    assert (pace.n_resumed, pace.n_new) == (40, 10)


def test_the_pace_of_a_slow_model_is_in_seconds_for_each():
    pace = Pace(3, 0.0)
    pace.count(False, 60.0)
    assert pace.speed(60.0) == "60.0 s each"
    assert pace.line(60.0) == "1 of 3 (33 %), 2 min left, 60.0 s each"


def test_the_time_left_is_steady_where_groups_cost_more_later_and_their_first_unit_most_of_it():
    # Ten groups of five units on 5 frames, then ten on 95: a second for each frame, with the first.
    groups = [5] * 10 + [95] * 10
    n_units, total = 100, sum(groups)
    weights = [5 + frames for frames in groups]
    pace, now, told = Pace(n_units, 0.0), 0.0, []
    pace.weigh(0, sum(weights), now)
    for at, frames in enumerate(groups):
        for number in range(5):
            now += frames if number == 0 else 0.0
            pace.count(False, now)
            if number == 4:
                pace.weigh(sum(weights[: at + 1]), sum(weights[at + 1 :]), now)
            left = re.search(r"([\d.]+) (s|min) left", pace.line(now))
            if left:
                told.append((float(left[1]) * (60 if left[2] == "min" else 1), total - now))
    assert len(told) == n_units - 4  # none before the first group is done
    assert [it for it in told if not 0.5 * it[1] - 30 <= it[0] <= it[1] + 60] == []
    by_units = Pace(n_units, 0.0)  # what a mean over units says where the cheap ones are done
    for _ in range(50):
        by_units.count(False, 50.0)
    assert by_units.line(50.0) == "50 of 100 (50 %), 50.0 s left, 1.0 a second"  # of 950


@pytest.mark.parametrize(
    ("n_units", "every_s", "expected"),
    [
        (100, 0.01, []),  # all done within a second: the line at the end of the run tells it
        (1000, 0.1, [10, 20, 30, 40, 50, 60, 70, 80, 90]),
        (10_000, 1.0, [60, 120, 180]),  # a step is minutes
        (20, 200.0, [200, 400, 600]),
    ],
)
def test_lines_come_at_sensible_intervals(n_units, every_s, expected):
    pace, lines_at = Pace(n_units, 0.0), []
    for number in range(1, n_units + 1):
        now = round(number * every_s, 6)
        pace.count(False, now)
        if pace.is_due(now):
            lines_at.append(now)
    assert lines_at[: len(expected)] == expected
    assert bool(lines_at) == bool(expected)


def test_work_in_a_pipe_prints_lines_without_resumed_units(monkeypatch):
    monkeypatch.setattr("infthor_eval.cli.progress.pace._MIN_INTERVAL_S", 0.0)
    clock = iter(range(100))
    monkeypatch.setattr("infthor_eval.cli.progress.bar.time.monotonic", lambda: float(next(clock)))
    output = io.StringIO()
    with progress_bar(Console(file=output)) as progress:
        bar = PacedBar(progress, "replay", 4)
        for resumed in (True, True, False, False):
            bar.advance(resumed=resumed)
    assert output.getvalue().splitlines()[-1] == "replay: 3 of 4 (75 %), 1.0 s left, 1.0 a second"


def test_a_resumed_training_prints_its_own_pace(monkeypatch):
    monkeypatch.setattr("infthor_eval.cli.progress.pace._MIN_INTERVAL_S", 0.0)
    clock = iter(range(0, 200, 2))
    monkeypatch.setattr("infthor_eval.cli.progress.bar.time.monotonic", lambda: float(next(clock)))
    output = io.StringIO()
    with progress_bar(Console(file=output)) as progress:
        bars = StepBars(progress)
        for step in (7, 8, 9):
            bars.advance("train", step, 10, f"loss {step}")
        bars.advance("answer", 1, 5, "loss 3")
    assert output.getvalue().splitlines() == [
        "train: 8 of 10 (80 %), 4.0 s left, 2.0 s each; loss 8",
        "train: 9 of 10 (90 %), 2.0 s left, 2.0 s each; loss 9",
    ]


def test_where_there_is_no_terminal_no_bar_is_left():
    output = io.StringIO()
    with progress_bar(Console(file=output)) as progress:
        progress.advance(progress.add_task("work", total=1))
    assert output.getvalue() == ""


def test_a_run_in_a_pipe_prints_lines_without_colour(make_nieh_set, tmp_path, run_cli, monkeypatch):
    monkeypatch.setattr("infthor_eval.cli.progress.pace._MIN_INTERVAL_S", 0.0)
    arguments = option_words(
        model="oracle", tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path
    )
    _, out, err = run_cli(*arguments)
    lines = err.splitlines()
    assert [line.partition(")")[0] for line in lines[:-1]] == [
        f"oracle: {n} of 5 ({20 * n} %" for n in range(1, 5)
    ]
    assert lines[-1] == "oracle: 5 evaluated now, 0 resumed from the journal"
    assert "\x1b" not in out + err


def test_quiet_prints_only_failures(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    frame = data / "metadata" / "traj_a" / "img" / "000000001.png"
    frame.write_bytes(frame.read_bytes()[:50])
    arguments = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_gt", data=data, out=tmp_path / "out"
    )
    code, _, err = run_cli(*arguments, "--quiet")
    assert code == 1
    assert err.startswith("nieh_gt: 2 sample(s) failed")


def test_a_duration_has_one_unit():
    durations = [format_duration(seconds) for seconds in (1.5, 119, 240, 7200)]
    assert durations == ["1.5 s", "119.0 s", "4 min", "2.0 h"]
