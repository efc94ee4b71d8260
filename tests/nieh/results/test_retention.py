"""Retention and half-life on made-up readers, whose truth is known."""

import math
import random

import pytest

from infthor_eval.nieh.results import retention
from infthor_eval.nieh.results.retention import Ladder, retention_of

RUNGS = (10, 30, 100, 300, 1000, 3000)
EASY, HARD = 0.9, 0.4  # shares of pairs right as long as nothing is forgotten


def made_up(rng, half_life, n_bases=24, per_base=12):
    """Ladders of a reader that forgets by halves from the first rung on. Half of the questions are
    easy, and these leave first."""
    ladders = []
    for base in range(n_bases):
        luck = rng.uniform(0.8, 1.2)  # homes differ
        for number in range(per_base):
            is_easy = number % 2
            reach = rng.choice((2, 3)) if is_easy else rng.choice((3, 4, 5, 6))
            draw = rng.random()
            net = {}
            for rung in RUNGS[:reach]:
                kept = 0.5 ** ((rung - RUNGS[0]) / half_life)
                right = draw < min(1, luck * (EASY if is_easy else HARD)) * kept
                net[rung] = float(right) - float(rng.random() < 0.02)
            ladders.append(Ladder(f"base {base}", net))
    return ladders


@pytest.mark.parametrize(("half_life", "truth"), [(30, 40.0), (300, 310.0), (math.inf, math.inf)])
def test_the_half_life_of_made_up_readers_is_found(half_life, truth):
    rng = random.Random(0)
    runs = 40
    assert sum(holds(retention_of(made_up(rng, half_life)), truth) for _ in range(runs)) >= 37


def holds(found, truth):
    """Whether the interval of the half-life holds the truth."""
    assert found.half_life is not None
    low = math.inf if found.low is None else found.low
    high = math.inf if found.high is None else found.high
    is_endless = math.isinf(truth) and math.isinf(high)
    return is_endless or low <= truth <= high


@pytest.fixture
def few(monkeypatch):
    """Few questions are enough, as their sums are made by hand."""
    monkeypatch.setattr(retention, "_FEWEST", 1)


def test_a_curve_ends_before_an_age_with_few_questions():
    ladders = [Ladder(f"b{at}", {10: 1.0, 30: 1.0}) for at in range(14)]
    ladders += [Ladder(f"b{at}", {10: 1.0, 30: 1.0, 100: 0.0}) for at in range(6)]
    found = retention_of(ladders)
    assert [(it.age, it.n) for it in found.kept] == [(10, 20), (30, 20)]
    assert found.half_life == (30, None)
    assert retention_of(ladders[1:]) is None


@pytest.mark.usefixtures("few")
def test_questions_that_leave_do_not_bend_the_curve():
    easy = [Ladder(f"b{at}", {10: 1.0, 30: 1.0}) for at in range(6)]
    hard = [
        Ladder(f"b{at}", {10: it, 30: it, 100: it}) for at in range(6) for it in (0.0, 1.0, 0.0)
    ]
    found = retention_of([*easy, *hard])
    assert [(it.age, it.share) for it in found.kept] == [(10, 1.0), (30, 1.0), (100, 1.0)]
    assert [it.n for it in found.kept] == [24, 24, 18]
    assert found.half_life == (100, None) and found.high is None


@pytest.mark.usefixtures("few")
def test_the_half_is_passed_between_two_ages():
    ladders = [Ladder(f"b{at}", {10: 1.0, 30: 1.0, 100: float(at < 1)}) for at in range(6)]
    found = retention_of(ladders)
    assert found.half_life == (30, 100)
    assert found.kept[-1].share == pytest.approx(1 / 6)
    assert 30 < found.low < found.high


@pytest.mark.usefixtures("few")
def test_where_nothing_is_known_at_first_nothing_is_kept():
    blind = [Ladder(f"b{at}", {10: (-1.0) ** at, 30: 1.0}) for at in range(6)]
    assert retention_of(blind).half_life is None


@pytest.mark.usefixtures("few")
def test_a_reader_of_the_last_frames_has_nothing_beyond():
    ladders = [Ladder(f"b{at}", {rung: float(rung <= 30) for rung in RUNGS}) for at in range(4)]
    found = retention_of(ladders)
    assert [it.share for it in found.kept] == [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    assert found.half_life == (30, 100)


@pytest.mark.usefixtures("few")
def test_one_base_has_no_interval_and_one_age_no_retention():
    assert retention_of([Ladder("a", {10: 1.0}), Ladder("b", {12: 1.0})]) is None
    found = retention_of([Ladder("a", {10: 1.0, 30: 0.0})])
    assert found.half_life == (10, 30) and found.low is found.high is None
