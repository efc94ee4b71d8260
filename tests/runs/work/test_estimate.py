"""What a run is taken to take: by hand for groups of known cost, and on a suite that costs what it
says."""

import time
from dataclasses import astuple

import pytest

from infthor_eval.errors import ModelError
from infthor_eval.runs import Group, RunConfig, Unit, UnitKey, Usage, Workload, estimate_run
from infthor_eval.runs.work.estimate import Quantities, _MeasuredGroup, estimate_tasks

from ...helpers.command_line import option_words
from ...helpers.toy_suite import Sum, Sums, ToySuite, make_suite
from ..toy_command import request


def group(task, name, n, frames):
    return Group(
        [Unit(UnitKey(task, f"{name}{k}"), name, Sum((k, 0))) for k in range(n)], frames=frames
    )


def took(seconds, read, encoded):
    return Quantities(seconds, 1, read, encoded, 5, 0.25)


def test_the_first_unit_of_a_group_pays_for_its_frames_and_every_unit_for_itself():
    work = Workload(
        [group("full", "a", 10, 100), group("full", "b", 4, 300), group("gt", "c", 7, 9)]
    )
    done = [
        _MeasuredGroup(
            100,
            [
                ("full", took(21, 1000, 1100)),
                ("full", took(1, 1000, 100)),
                ("full", took(1, 1000, 100)),
            ],
        ),
        _MeasuredGroup(9, [("gt", took(2, 50, 50)), ("gt", took(2, 50, 50))]),
    ]
    full, gt = estimate_tasks(work, done)
    # 20 s and 1,000 tokens for 100 frames, then 1 s and 100 tokens a unit.
    assert (full.n_units, full.n_measured, full.frames) == (14, 3, 400)
    assert astuple(full.total) == pytest.approx(
        (0.2 * 400 + 14, 14, 14_000, 10 * 400 + 1_400, 70, 3.5)
    )
    assert astuple(gt.total) == pytest.approx((14, 7, 350, 350, 35, 1.75))


def test_groups_of_several_tasks_share_their_frames_by_units():
    mixed = Group([*group("pick", "a", 3, 1).units, *group("put", "b", 1, 1).units], frames=40)
    done = [
        _MeasuredGroup(
            40, [("pick", took(5, 0, 0)), ("pick", took(1, 0, 0)), ("put", took(3, 0, 0))]
        )
    ]
    pick, put = estimate_tasks(Workload([mixed]), done)
    assert pick.total.seconds == pytest.approx(4 * 3 / 4 + 3 * 1)
    assert put.total.seconds == pytest.approx(4 * 1 / 4 + 1 * 3)
    assert (pick.frames, put.frames) == (30, 10)


class Costly(Sums):
    """Six groups; the first unit of each takes longer, the others as long as they say."""

    def __init__(self):
        self.workload = Workload(
            [group("sums", f"{a}.", 5, 10 * a) for a in range(1, 7)], (), RunConfig()
        )

    def run(self, costly_group, session):
        time.sleep(0.002 * costly_group.frames)
        for unit in costly_group.units:
            time.sleep(0.01)
            yield unit.record(
                "f", unit.payload, usage=Usage(requests=2, context=100, cached=40, reply=3)
            )


def test_a_few_units_tell_what_all_take_and_nothing_is_written(tmp_path):
    estimated = estimate_run(request(tmp_path), make_suite(Costly), 9, lambda: None)
    (sums,) = estimated.tasks
    assert (sums.n_units, sums.n_measured, sums.frames) == (30, 9, 210)
    assert (
        sums.total.requests,
        sums.total.read,
        sums.total.encoded,
        sums.total.written,
    ) == pytest.approx((60, 3000, 1800, 90))
    assert 0.002 * 210 + 30 * 0.01 < sums.total.seconds < 5 * (0.002 * 210 + 30 * 0.01)
    assert list(tmp_path.rglob("*.jsonl")) == []


def test_units_that_fail_are_told_and_the_others_tell_what_it_takes(tmp_path):
    estimated = estimate_run(request(tmp_path), ToySuite(), 6, lambda: None)
    assert estimated.failures == [("sums", "the abacus is broken")] * 2
    assert [(item.n_units, item.n_measured) for item in estimated.tasks] == [(4, 2)]


def test_where_every_unit_fails_nothing_is_told(tmp_path, capfd):
    from infthor_eval.cli.commands.plan import plan

    class Broken(Sums):
        def run(self, failing_group, session):
            raise ModelError("no memory for a single frame")

    with pytest.raises(ModelError, match="every measured sample failed; fix the failures above"):
        plan(request(tmp_path), make_suite(Broken), 6, None)
    assert (
        "sums: 4 measured sample(s) failed: no memory for a single frame" in capfd.readouterr().err
    )


def test_the_command_prints_units_tokens_time_memory_and_money(run_cli, tmp_path):
    words = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_mini_gt", out=tmp_path / "out", workers=2
    )
    code, output, err = run_cli(
        "plan", *words, "--measure", 9, "--price-per-hour", 2.5, "--limit", 6
    )
    assert code == 0, err
    (row,) = [line.split() for line in output.splitlines() if line.startswith("  nieh_mini_gt")]
    assert (row[1], row[2], row[4]) == ("6", "3", "6")
    assert "by 2 workers, loading not counted" in output
    assert " MB at most while measuring" in output
    assert "US dollars of machines at 2.5 an hour" in output
    assert "contexts, the longest request" in err
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").rglob("*.jsonl"))


def test_a_cap_on_what_is_spent_holds_for_one_process_and_says_so(run_cli, tmp_path):
    words = option_words(model="openai", model_args="model=m", tasks="nieh_mini_gt", out=tmp_path)
    code, _, err = run_cli(*words, "--max-tokens-total", 100, "--workers", 2)
    assert code == 2
    assert (
        "max_tokens_total counts the requests of one process; leave out --workers, or the cap"
        in err
    )
