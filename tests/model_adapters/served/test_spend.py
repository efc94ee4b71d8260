"""Caps on tokens and money, and keeping to so many a minute."""

import time
from concurrent.futures import ThreadPoolExecutor
from threading import Lock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters.served.completion import TokenUsage
from model_adapters.served.spend import Caps, Charge, Prices, RateLimiter, Spend


def _took(spend, tokens, cost=0.0):
    with spend.request() as charge:
        charge.sent, charge.tokens, charge.cost = True, tokens, cost


def test_cached_tokens_cost_what_they_cost():
    prices = Prices(prompt=2.0, cached=0.5, reply=8.0)
    assert prices.cost(TokenUsage(1_000_000, 0)) == 2.0
    used = TokenUsage(1_000_000, 100_000, n_cached=400_000)
    assert prices.cost(used) == pytest.approx(0.6 * 2 + 0.4 * 0.5 + 0.1 * 8)


def test_what_is_put_into_the_cache_has_its_own_price():
    used = TokenUsage(1_000_000, 0, n_cached=400_000, n_stored=500_000)
    prices = Prices(prompt=2.0, cached=0.5, reply=8.0, stored=2.5)
    assert prices.cost(used) == pytest.approx(0.1 * 2 + 0.4 * 0.5 + 0.5 * 2.5)
    assert Prices(2.0, 0.5, 8.0).cost(used) == pytest.approx(0.6 * 2 + 0.4 * 0.5)


@pytest.mark.parametrize(
    ("caps", "room"),
    [
        (Caps(), None),
        (Caps(tokens=1000), 9),
        (Caps(cost=1.0), 4),
        (Caps(tokens=1000, cost=1.0), 4),
        (Caps(tokens=101), 1),
    ],
)
def test_a_batch_is_as_large_as_the_caps_allow(caps, room):
    spend = Spend("m", caps)
    assert spend.room() == (None if room is None else 1)  # the first one tells what one takes
    spend.add(Charge(tokens=100, cost=0.2, sent=True))
    assert spend.room() == room


def test_there_is_no_room_beyond_the_caps():
    spend = Spend("m", Caps(tokens=100))
    spend.add(Charge(tokens=100, sent=True))
    with pytest.raises(ModelError, match="not asked: 100 tokens reach max_tokens_total=100"):
        spend.room()


@given(st.lists(st.integers(0, 50), min_size=1, max_size=30), st.integers(1, 200))
def test_nothing_is_begun_once_the_cap_is_reached(takes, cap):
    spend, taken = Spend("m", Caps(tokens=cap)), 0
    for tokens in takes:
        if taken >= cap:
            with pytest.raises(
                ModelError,
                match=f"not asked: {taken} tokens reach max_tokens_total={cap}; raise it",
            ):
                _took(spend, tokens)
        else:
            _took(spend, tokens)
            taken += tokens


def test_money_is_capped_likewise():
    spend = Spend("m", Caps(cost=1.0))
    _took(spend, 10, 0.6)
    _took(spend, 10, 0.6)
    with pytest.raises(
        ModelError,
        match=r"not asked: 1\.2000 US dollars reach max_cost=1; raise it and run the same",
    ):
        _took(spend, 10, 0.6)


def test_a_request_that_failed_without_a_reply_takes_nothing():
    spend = Spend("m", Caps(tokens=5))
    with pytest.raises(OSError), spend.request():
        raise OSError
    _took(spend, 5)
    with pytest.raises(ModelError):
        _took(spend, 1)


def test_a_server_that_does_not_tell_is_asked_once_under_a_cap_and_for_ever_without():
    capped, free = Spend("m", Caps(tokens=100)), Spend("m", Caps())
    for spend in (capped, free):
        _took(spend, None)
    _took(free, None)
    with pytest.raises(
        ModelError, match="m does not report the usage of its replies, so caps cannot be enforced"
    ):
        _took(capped, None)


def test_a_reply_that_does_not_tell_counts_as_the_dearest_before_it():
    spend = Spend("m", Caps(tokens=100))
    for tokens in (10, 40, None, None):
        _took(spend, tokens)
    with pytest.raises(ModelError, match="not asked: 130 tokens reach max_tokens_total=100"):
        _took(spend, 1)


def test_threads_pass_a_cap_by_one_request_at_most():
    spend, taken, lock = Spend("m", Caps(tokens=100)), [], Lock()

    def ask(_number):
        try:
            with spend.request() as charge:
                time.sleep(0.002)
                charge.sent, charge.tokens = True, 15
                with lock:
                    taken.append(15)
        except ModelError:
            return False
        return True

    with ThreadPoolExecutor(8) as pool:
        allowed = list(pool.map(ask, range(40)))
    assert sum(taken) == 105
    assert allowed.count(True) == 7


@pytest.fixture
def clock(monkeypatch):
    """A clock that waiting turns on; its one item is the time."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    return now


def test_a_pace_is_even(clock):
    pace, begun = RateLimiter(30), []
    for _ in range(4):
        pace.wait()
        begun.append(clock[0] - 100)
    assert begun == [0, 2, 4, 6]


def test_what_was_taken_is_made_up_for_and_what_was_given_back_is_not_waited_for(clock):
    pace = RateLimiter(60)
    pace.wait(10)
    pace.take(20)  # it was 30
    pace.wait(10)
    assert clock[0] == 130
    pace.take(-10)  # it was none
    pace.wait(0)
    assert clock[0] == 130


def test_without_a_limit_nothing_is_waited_for(clock):
    pace = RateLimiter(None)
    for _ in range(5):
        pace.wait(1e9)
        pace.take(1e9)
    assert clock[0] == 100
