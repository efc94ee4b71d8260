"""Measures the processor time of tests, and decides by it which are slow.

    make test-times        # all tests, with this plugin, then `python -m tests.processor_times`

A pytest plugin (`-p tests.processor_times`) writes the processor seconds of each test, with its
child processes and its share of fixtures that others use, too, into build/processor_times/. The
command lists those above `LIMIT_S` in tests/slow_tests.txt, but the quickest of each file; `make
test` leaves them out, and `make test-all` runs them. Processor time changes little with other work
on the machine.
"""

import json
import os
import resource
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import psutil
import pytest

__all__ = ["LIMIT_S", "read_slow_tests"]

LIMIT_S = 0.5
_QUICKEST_S = 2.0  # the quickest test of a file that takes no more is never slow
# Slow ones that `make test` runs all the same: no other test goes the same whole way, or later ones
# need their results.
KEPT = (
    "tests/generation/test_factory.py::test_at_dead_ends_1_2_and_4_subgoals_are_dropped",
    "tests/nieh/test_suite.py::test_the_tiny_model_runs_through_and_shares_prefixes",
    "tests/model_adapters/hf/test_conversation.py::test_sharing_changes_no_reply",
    "tests/manipulation/test_episodes.py::test_the_planner_picks_up_and_puts_all",
    "tests/runs/work/test_driver.py::test_a_killed_command_goes_on_and_shows_progress_table_results_and_export",
    "tests/docs/test_commands.py::test_the_commands_of_a_page_run_one_after_the_other[docs/tutorial.md-2]",
    "tests/test_statistics.py::test_the_interval_covers_the_truth_as_often_as_it_says",
    "tests/formats/test_qa_csv.py::test_what_is_written_is_read_back",
    "tests/docs/test_commands.py::test_the_commands_of_a_page_run_one_after_the_other[docs/own-models.md-0]",
    "tests/runs/work/test_driver.py::test_two_workers_have_the_results_of_one_process",
    "tests/runs/work/test_worker_executor.py::test_tracebacks_of_workers_are_kept_too",
    "tests/model_adapters/policies/test_adapters.py::test_the_twins_keep_the_contract[openvla-tiny]",
    "tests/plans/actors/test_model.py::test_the_experts_own_words_carry_every_plan_out",
    "tests/nieh/asking/test_notebook.py::test_a_note_is_what_the_model_says_to_its_window_alone",
    "tests/training/test_fine_tuning.py::test_adapters_are_trained_and_merged",
    "tests/recipes/nano/test_nano.py::"
    "test_a_stopped_training_continues_to_the_same_weights[vision]",
    "tests/harness/test_host.py::test_our_model_under_lm_evals_own_command_gives_the_samples_of_our_own",
    "tests/harness/test_vla_eval.py::"
    "test_an_episode_that_cannot_begin_or_loses_its_simulator_fails_alone",
    "tests/harness/test_inspect_robots.py::"
    "test_an_episode_that_cannot_begin_or_loses_its_simulator_has_no_score",
    "tests/cli/commands/data/test_data_commands.py::test_the_three_commands_make_a_set",
    "tests/plans/actors/test_planner.py::test_every_plan_is_carried_out[bedroom-2-seed7]",
    "tests/report/suites/test_reward_curves.py::test_the_six_panels_are_drawn_over_thousands_of_tokens_with_the_planner_in_each",
    "tests/report/web/test_browser.py::test_it_opens_without_errors_and_fetches_nothing",
    "tests/examples/test_sums.py::test_its_results_are_shown_and_exported",
    "tests/runs/work/test_worker_executor.py::test_workers_that_are_killed_lose_nothing_that_was_finished",
    "tests/benchmarks/test_families.py::test_six_families_reply_as_transformers_does",
    "tests/model_adapters/human/test_page.py::test_ten_questions_by_keyboard_alone",
    "tests/cli/commands/test_explain.py::"
    "test_a_planted_cause_is_named[first0-second0-the size of images-longest_edge]",
    "tests/nieh/rescoring/test_rebuilt_requests.py::"
    "test_every_context_comes_out_as_it_was_sent[nieh_mini_full-options3]",
    "tests/infthor_sim/test_snapshots.py::"
    "test_nothing_saved_and_a_saved_state_of_another_scene_are_refused",
    "tests/plans/twins/test_suite.py::test_who_does_not_remember_has_no_pair[history]",
    "tests/infthor_board/test_honest.py::test_the_bundled_model_passes",
    "tests/infthor_board/test_page.py::test_it_is_as_wide_as_the_page_and_readable[light-1400]",
    "tests/report/web/test_pairs.py::"
    "test_both_replies_stand_beside_each_other_and_filters_are_of_pairs",
)
_ROOT = Path(__file__).parents[1]
_LIST = Path(__file__).with_name("slow_tests.txt")
_MEASURED = _ROOT / "build" / "processor_times"
_HEAD = """\
# Tests that take more than {limit} s of processor time: `make test` leaves them out, `make \
test-all` runs them.
# Written by `make test-times` (tests/processor_times.py says how). A line: seconds, test.
"""


def read_slow_tests() -> set[str]:
    """Return the ids of the slow tests."""
    return {test for test, _ in _read_listed()}


def _read_listed() -> Iterator[tuple[str, float]]:
    """Yield the slow tests with their seconds, which the list rounds."""
    for line in _LIST.read_text().splitlines():
        if line and not line.startswith("#"):
            taken, test = line.split(maxsplit=1)
            yield test, float(taken)


def _processor_seconds() -> float:
    """Return what this process has used, with children that have ended and those that have not: a
    simulator lives as long as its fixture."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    ended = sum(usage.ru_utime + usage.ru_stime for usage in used)
    return ended + sum(map(_seconds_of, psutil.Process().children(recursive=True)))


def _seconds_of(process: psutil.Process) -> float:
    try:
        times = process.cpu_times()
    except psutil.NoSuchProcess:
        return 0.0
    return float(times.user + times.system + times.children_user + times.children_system)


_shared: dict[str, float] = {}  # what was spent on each fixture that several tests may use


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(
    fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest
) -> Iterator[None]:
    """Measure what a fixture takes, unless it is of one test alone."""
    before = _processor_seconds()
    try:
        return (yield)
    finally:
        if fixturedef.scope != "function":
            key = _key(fixturedef, request.param if hasattr(request, "param") else None)
            _shared[key] = _shared.get(key, 0.0) + _processor_seconds() - before


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Write what a test takes itself, and which shared fixtures it uses."""
    before, before_shared = _processor_seconds(), sum(_shared.values())
    result = yield
    own = _processor_seconds() - before - (sum(_shared.values()) - before_shared)
    used = {key: _shared[key] for key in _keys_of(item) if key in _shared}
    _MEASURED.mkdir(parents=True, exist_ok=True)
    with (_MEASURED / f"{os.getpid()}.jsonl").open("a") as file:
        file.write(json.dumps([item.nodeid, round(own, 3), used]) + "\n")
    return result


def _key(fixture: pytest.FixtureDef[object], param: object) -> str:
    return f"{fixture.baseid}::{fixture.argname}[{param!r}]"


def _keys_of(item: pytest.Item) -> Iterator[str]:
    """Yield the names of the fixtures that a test uses, of whatever scope."""
    params = item.callspec.params if hasattr(item, "callspec") else {}
    for name in getattr(item, "fixturenames", ()):
        for fixture in item._fixtureinfo.name2fixturedefs.get(name, ())[-1:]:
            yield _key(fixture, params.get(name))


def _read_measured() -> Counter[str]:
    """Return the seconds of each test that was measured: its own, and its share of what it uses
    together with others."""
    seconds: Counter[str] = Counter()
    for path in _MEASURED.glob("*.jsonl"):
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        users = Counter(key for _, _, used in lines for key in used)
        for test, own, used in lines:
            shares = sum(taken / users[key] for key, taken in used.items())
            seconds[test] = max(seconds[test], own + shares)
    return seconds


def _quickest_of_files(seconds: Mapping[str, float]) -> Iterator[str]:
    """Yield the quickest test of each file, so that `make test` leaves out few files wholly."""
    by_file: dict[str, list[str]] = {}
    for test in seconds:
        by_file.setdefault(test.partition("::")[0], []).append(test)
    for tests in by_file.values():
        quickest = min(tests, key=lambda test: (seconds[test], test))
        if seconds[quickest] <= _QUICKEST_S:
            yield quickest


def main() -> None:
    """Write the list of slow tests from what was measured; tests that were not measured stay as
    they are listed."""
    measured = _read_measured()
    listed = {test: taken for test, taken in _read_listed() if test not in measured}
    seconds = listed | measured
    above = {test for test, taken in measured.items() if taken > LIMIT_S}
    slow = sorted({*listed, *above}.difference(KEPT, _quickest_of_files(measured)))
    lines = [f"{seconds[test]:7.1f} {test}" for test in slow]
    _LIST.write_text(_HEAD.format(limit=LIMIT_S) + "\n".join(lines) + "\n")
    of_slow = sum(seconds[test] for test in slow)
    print(
        f"{len(slow)} slow tests: {of_slow:.0f} s of processor time; others: "
        f"{sum(seconds.values()) - of_slow:.0f} s"
    )


if __name__ == "__main__":
    main()
