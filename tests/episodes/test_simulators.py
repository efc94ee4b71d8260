"""Simulators that are used in turn."""

from contextlib import closing

from infthor_eval.episodes.simulators import Simulators


def test_a_simulator_is_used_again_by_the_next_and_by_nobody_at_the_same_time():
    with closing(Simulators("embedded", None, [], image=False, instances=False)) as simulators:
        with simulators.one() as first, simulators.one() as second:
            assert first is not second
        with simulators.one() as again:
            assert again in (first, second)
        assert (first.label, first.restarts) == ("embedded", 0)
