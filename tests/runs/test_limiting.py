"""What a limit takes: evenly from all trajectories, the same for a seed, and more of the same with
a larger one."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.runs.limiting import limit_items, spread

ITEMS = st.lists(st.tuples(st.sampled_from("abcdef"), st.integers()), unique=True, max_size=40)


def of(item):
    return item[0]


@given(ITEMS, st.integers())
def test_every_item_has_its_place(items, seed):
    assert sorted(spread(items, of, seed)) == list(range(len(items)))


@given(ITEMS, st.integers(), st.integers(1, 50))
def test_no_trajectory_is_asked_twice_before_every_other_is_asked_once(items, seed, limit):
    taken, there = Counter(map(of, limit_items(items, of, seed, limit))), Counter(map(of, items))
    assert sum(taken.values()) == min(limit, len(items))
    most = max(taken.values(), default=0)
    assert all(taken[cluster] >= min(most - 1, n) for cluster, n in there.items())


@given(ITEMS, st.integers(), st.integers(1, 50))
def test_a_larger_limit_takes_more_of_the_same_in_their_own_order(items, seed, limit):
    few, more = (limit_items(items, of, seed, n) for n in (limit, limit + 1))
    assert set(few) <= set(more)
    assert more == [item for item in items if item in more]
    assert limit_items(items, of, seed, None) == items


def test_another_seed_takes_others():
    items = [(cluster, number) for cluster in "ab" for number in range(50)]
    taken = {tuple(limit_items(items, of, seed, 4)) for seed in range(5)}
    assert len(taken) == 5
    assert limit_items(items, of, 3, 4) == limit_items(items, of, 3, 4)
