import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.statistics import (
    bootstrap_interval,
    clustered_mean,
    mean_over_clusters,
    paired_difference,
)

from .helpers.benchmarks import load_benchmark

scores = st.lists(
    st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 6)), min_size=2, max_size=60
)


@given(scores)
def test_clusters_of_one_give_the_textbook_standard_error(pairs):
    values = [value for value, _ in pairs]
    estimate = clustered_mean(values, list(range(len(values))))
    assert estimate.mean == pytest.approx(np.mean(values))
    assert estimate.stderr == pytest.approx(np.std(values, ddof=1) / math.sqrt(len(values)))


@given(scores)
def test_repeating_every_question_of_a_trajectory_adds_no_certainty(pairs):
    values, clusters = [v for v, _ in pairs], [c for _, c in pairs]
    once = clustered_mean(values, clusters)
    thrice = clustered_mean(values * 3, clusters * 3)
    assert thrice.mean == pytest.approx(once.mean)
    if once.stderr is not None:
        assert thrice.stderr == pytest.approx(once.stderr)


@pytest.mark.parametrize("right", [0.0, 1.0])
def test_scores_that_are_all_alike_leave_doubt_that_shrinks_with_the_trajectories(right):
    few, many = (clustered_mean([right] * 5 * n, list(range(n)) * 5) for n in (6, 60))
    for estimate in (few, many):
        assert estimate.low <= right <= estimate.high
        assert 0.0 <= estimate.low < estimate.high <= 1.0
    assert many.high - many.low < few.high - few.low


def test_no_right_answer_on_eight_trajectories_gives_wilsons_textbook_interval():
    z = 1.959964
    for per_trajectory in (1, 5):  # questions that are all right or all wrong together count as one
        estimate = clustered_mean([0.0] * 8 * per_trajectory, list(range(8)) * per_trajectory)
        assert (estimate.low, estimate.high) == (0.0, pytest.approx(z**2 / (8 + z**2), abs=1e-6))
        mirrored = clustered_mean([1.0] * 8 * per_trajectory, list(range(8)) * per_trajectory)
        assert (mirrored.low, mirrored.high) == (pytest.approx(8 / (8 + z**2), abs=1e-6), 1.0)


@given(scores)
def test_the_interval_of_wrong_answers_mirrors_that_of_right_ones(pairs):
    values, clusters = [value for value, _ in pairs], [cluster for _, cluster in pairs]
    right, wrong = (
        clustered_mean(values, clusters),
        clustered_mean([1 - value for value in values], clusters),
    )
    if right.stderr is not None:
        assert (wrong.low, wrong.high) == (
            pytest.approx(1 - right.high),
            pytest.approx(1 - right.low),
        )


def test_the_ends_of_an_interval_of_shares_solve_wilsons_equation():
    z, t = 1.959964, 2.262157  # t of 9 degrees of freedom
    estimate = clustered_mean([1.0] * 3 + [0.0] * 7, list(range(10)))
    design_effect = (3 * 10 / 9 * (t / z) ** 2 + 1) / (3 + 1)
    for end in (estimate.low, estimate.high):
        assert (end - 0.3) ** 2 == pytest.approx(
            z**2 * end * (1 - end) * design_effect / 10, rel=1e-5
        )
    assert estimate.low < 0.3 < estimate.high


@given(scores)
def test_intervals_of_shares_hold_the_mean_and_stay_among_shares(pairs):
    estimate = clustered_mean([value for value, _ in pairs], [cluster for _, cluster in pairs])
    if estimate.stderr is not None:
        assert 0.0 <= estimate.low <= estimate.mean <= estimate.high <= 1.0


def test_scores_beyond_one_get_a_t_interval():
    estimate = clustered_mean([1.5, 1.0, 1.5, 1.0], ["a", "b", "c", "d"])
    assert estimate.high - estimate.mean == pytest.approx(estimate.mean - estimate.low)
    assert estimate.high > 1.25


def test_one_trajectory_gives_no_interval():
    estimate = clustered_mean([1.0, 0.0], ["t", "t"])
    assert (estimate.mean, estimate.stderr, estimate.low, estimate.high) == (0.5, None, None, None)


@pytest.mark.parametrize(
    ("values", "clusters", "expected"),
    [
        ([], [], "no score"),
        ([1.0], [], "1 scores but 0"),
        ([1.0, 0.0], ["t", ""], "score 1 has no trajectory"),
    ],
)
def test_scores_that_cannot_be_clustered_are_refused(values, clusters, expected):
    with pytest.raises(DataError, match=expected):
        clustered_mean(values, clusters)


def test_the_bootstrap_agrees_with_the_formula_and_repeats():
    random = np.random.default_rng(1)
    values = random.integers(0, 2, 400).astype(float).tolist()
    clusters = random.integers(0, 50, 400).tolist()
    estimate = clustered_mean(values, clusters)
    interval = bootstrap_interval(values, clusters, seed=3)
    assert interval == pytest.approx((estimate.low, estimate.high), abs=0.015)
    assert bootstrap_interval(values, clusters, seed=3) == interval
    assert bootstrap_interval(values, clusters, seed=3, n_resamples=2000) == interval
    assert bootstrap_interval([1.0] * 4, [0, 0, 1, 1]) is None
    assert bootstrap_interval([1.0, 0.0], ["t", "t"]) is None


def test_a_paired_difference_is_surer_than_two_separate_runs():
    random = np.random.default_rng(2)
    first = random.integers(0, 2, 300).astype(float)
    second = np.where(random.random(300) < 0.1, 1.0, first)
    clusters = random.integers(0, 30, 300).tolist()
    difference = paired_difference(first.tolist(), second.tolist(), clusters)
    assert difference.estimate.mean == pytest.approx(second.mean() - first.mean())
    assert difference.p < 0.01
    assert paired_difference(first.tolist(), first.tolist(), clusters).p == 1.0
    assert paired_difference([0.0], [1.0], ["t"]).p is None
    with pytest.raises(DataError, match="cannot be paired"):
        paired_difference([0.0], [], ["t"])


def test_the_interval_covers_the_truth_as_often_as_it_says():
    module = load_benchmark("interval_coverage")
    clustered, independent = module.coverage(600, 60, 0.7)
    assert 0.92 <= clustered <= 0.98
    assert independent < 0.8
    few_wrong, _ = module.coverage(300, 12, 0.98)
    assert few_wrong >= 0.93


def test_a_mean_over_clusters_takes_no_number_for_a_share():
    estimate = mean_over_clusters([0.0, 1.0])
    assert (estimate.mean, estimate.stderr, estimate.n_clusters) == (0.5, 0.5, 2)
    assert (estimate.low, estimate.high) == (
        pytest.approx(-5.8531, abs=1e-4),
        pytest.approx(6.8531, abs=1e-4),
    )
    assert mean_over_clusters([3.0]).low is None
    with pytest.raises(DataError):
        mean_over_clusters([])


def test_the_interval_of_a_difference_ends_where_shares_do():
    first, second = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0], [0.0] * 6
    clusters = list("abcdef")
    beyond = paired_difference(first, second, clusters)
    within = paired_difference(first, second, clusters, most=1.0)
    assert beyond.estimate.low < -1
    assert (within.estimate.low, within.estimate.high) == (-1, beyond.estimate.high)
    assert (within.estimate.mean, within.p) == (beyond.estimate.mean, beyond.p)
