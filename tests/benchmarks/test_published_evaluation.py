"""The simulation of a full evaluation, by hand on cases small enough for that."""

import importlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.errors import UsageError

from ..helpers.command_line import option_words

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def costs(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("evaluation_costs")


@pytest.fixture
def script(costs: Any) -> Any:
    return importlib.import_module("published_evaluation")


@pytest.fixture
def simulation(costs: Any) -> Any:
    return importlib.import_module("evaluation_runs")


@pytest.fixture
def read(costs: Any) -> Callable[[list[str]], Any]:
    return partial(importlib.import_module("evaluation_options").read_arguments, "")


@pytest.fixture
def shape(costs: Any) -> Any:
    """Of 10 weights, and 16 bytes of keys and values a token."""
    return costs.Shape("toy", 10, 1, 4, 2, 2, 10, 100, vision_flop=0, frame_seconds=0)


@pytest.fixture
def machine(script: Any, read: Any) -> Any:
    return script.machine_of(read([]))


def test_a_request_encodes_what_is_not_there_and_looks_back_at_all(costs: Any) -> None:
    rates = costs.Rates(token=1.0, pair=0.1, step=2.0, cached_token=0.01)
    request = costs.Request(context=10, cached=6, reply=3)
    # 4 tokens; 4 * 6 pairs with what was there and 8 among themselves; 3 tokens of reply on a
    # context of 10.
    assert costs.seconds(request, rates) == pytest.approx(4 + 0.1 * (24 + 8) + 3 * 2.1)
    assert costs.seconds(request, rates, reuse=False) == pytest.approx(10 + 0.1 * 50 + 3 * 2.1)


def test_parts_of_a_context_take_what_the_whole_takes(costs: Any) -> None:
    rates = costs.Rates(token=1.0, pair=0.1, step=0.0, cached_token=0.0)
    parts = [costs.Request(end, start, 0) for start, end in ((0, 3), (3, 7), (7, 20))]
    assert sum(costs.seconds(part, rates) for part in parts) == pytest.approx(
        costs.seconds(costs.Request(20, 0, 0), rates)
    )


def test_rates_give_back_what_was_measured(costs: Any) -> None:
    rates = costs.Rates(0, 0, 0, 0)
    fitted = costs.rates_from_prefill(rates, (1000, 500.0), (3000, 250.0))
    for n, rate in ((1000, 500.0), (3000, 250.0)):
        assert n / costs.seconds(costs.Request(n, 0, 0), fitted) == pytest.approx(rate)


@pytest.mark.parametrize(
    "points", [((10, 1.0), (5, 0.5)), ((10, 1.0), (20, 2.0)), ((10, 1.0), (20, 0.1))]
)
def test_measurements_that_cannot_be_are_refused(costs: Any, points: Any) -> None:
    with pytest.raises(UsageError, match=r"must come second|measure a shorter"):
        costs.rates_from_prefill(costs.Rates(0, 0, 0, 0), *points)


def test_memory_is_weights_and_what_each_token_takes(costs: Any, shape: Any, machine: Any) -> None:
    assert (shape.weights, shape.kv_bytes, shape.pair_flop) == (20, 16, 32)
    small = replace(machine, memory=100, usable=0.9, gpus_per_node=4, attention="flash_attention_2")
    # 90 usable: 70 beside the weights; of two GPUs 160; of four 340.
    assert [costs.largest_context(shape, small, n) for n in (1, 2, 4)] == [4, 10, 21]
    assert [costs.gpus_for(shape, small, n) for n in (4, 5, 10, 11, 21, 22)] == [
        1,
        2,
        2,
        4,
        4,
        None,
    ]
    # SDPA repeats keys and values for 4 heads (32 bytes) and has a mask of 3 bytes for each token
    # of a chunk.
    assert (
        costs.context_bytes(shape, replace(small, attention="sdpa", chunk_tokens=12))
        == 16 + 32 + 36
    )


def test_published_shapes_take_the_memory_that_is_known_of_them(costs: Any) -> None:
    assert {model.name: model.kv_bytes for model in costs.MODELS} == {
        "llava-onevision": 57_344,
        "qwen2.5-vl": 57_344,
        "deepseek-vl": 491_520,
        "pixtral": 163_840,
    }


def test_the_longest_goes_first_to_whoever_is_free(costs: Any) -> None:
    assert costs.makespan([1, 2, 3, 4, 5], 2) == 8  # 5, 2, 1 and 4, 3
    assert costs.makespan([1, 2, 3], 8) == 3
    assert costs.makespan([1, 2, 3], 1) == 6


def test_a_trajectory_is_encoded_once_and_windows_by_what_they_share(
    simulation: Any, read: Any, shape: Any
) -> None:
    options = read(["--text-tokens", "5", "--reply-tokens", "2", "--step-tokens", "0"])
    trajectory = simulation.Trajectory(20, ((3,), (12,), (3,)))
    gt, full, *_, plans = simulation.modes(options)
    requests, _ = simulation.requests(trajectory, full, shape, options)
    assert [(request.context, request.cached) for request in requests] == [
        (205, 0),
        (205, 200),
        (205, 200),
    ]
    requests, _ = simulation.requests(trajectory, gt, shape, options)
    assert [(request.context, request.cached) for request in requests] == [
        (15, 0),
        (15, 10),
        (15, 0),
    ]
    requests, _ = simulation.requests(trajectory, plans, shape, options)
    assert [(request.context, request.cached) for request in requests[:3]] == [
        (10, 0),
        (20, 10),
        (30, 20),
    ]
    assert len(requests) == 20


def test_the_haystack_is_the_harness_own(simulation: Any, read: Any, shape: Any) -> None:
    options = read(["--text-tokens", "0"])
    mode = simulation.Mode("haystack", simulation._haystack_of(1, 0))
    # Windows of 10 frames, which begin 0, 2, 4, 6, 8 before the clue.
    wide = replace(shape, frame_tokens=100)
    trajectory = simulation.Trajectory(15, ((5,), (5,)))
    requests, n_missing = simulation.requests(trajectory, mode, wide, options)
    assert n_missing == 4  # two begin before the trajectory, for each of the two questions
    assert [(request.context, request.cached) for request in requests] == [
        (1000, 0),
        (1000, 1000),
    ] * 3


def test_a_run_counts_what_is_too_long_and_what_no_node_has_room_for(
    simulation: Any, read: Any, costs: Any, shape: Any, machine: Any
) -> None:
    options = read(["--text-tokens", "0", "--reply-tokens", "0", "--max-context", "250"])
    small = replace(
        machine, memory=100, usable=1.0, gpus_per_node=32, attention="flash_attention_2"
    )
    # 198 tokens fit on 32 GPUs, 98 on 16.
    trajectories = [simulation.Trajectory(n, ((0,), (1,))) for n in (10, 19, 20, 30)]
    rates = costs.Rates(token=36.0, pair=0.0, step=0.0, cached_token=0.0)
    full = simulation.modes(options)[1]
    one = simulation.run(full, shape, trajectories[:2], rates, small, options)
    assert (one.n_requests, one.n_skipped, one.n_gpus, one.tokens, one.encoded) == (
        4,
        (0, 0, 0),
        32,
        580,
        290,
    )
    assert one.jobs == ((3600.0, 6840.0), (7200.0, 13680.0))
    assert [one.hours(n, 0) for n in (8, 32, 64)] == [None, 2.9, 1.9]
    assert one.hours(64, 360, reuse=False) == pytest.approx(3.9)
    less = simulation.run(
        full, shape, trajectories, rates, replace(small, gpus_per_node=16), options
    )
    assert (less.n_requests, less.n_skipped) == (0, (0, 2, 6))
    assert (less.hours(64, 0), less.n_gpus) == (0, 0)


def test_the_same_seed_gives_the_same_table(
    script: Any, simulation: Any, read: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    words = option_words(
        trajectories="3", haystack="8", prefill="pixtral=1000:9000,9000:6000", decode="pixtral=9"
    )
    options = read(words)
    trajectories = simulation.draw(options)
    assert trajectories == simulation.draw(options)
    assert {300 <= trajectory.n_frames <= 2287 for trajectory in trajectories} == {True}
    machine = script.machine_of(options)
    rates = script.rates_of(script.MODELS[3], machine, options)
    assert rates.step == pytest.approx(1 / 9)
    assert rates != script.rates_of(script.MODELS[3], machine, read([]))
    runs = [
        simulation.run(mode, model, trajectories, rates, machine, options)
        for mode in simulation.modes(options)
        for model in script.MODELS
    ]
    table_lines = script.cost_table(runs, 120, 3.0).splitlines()
    assert len(table_lines) == 1 + 4 * 4 + 4 + 1
    assert {len(line) for line in table_lines} == {len(table_lines[0])}
