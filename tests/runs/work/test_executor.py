"""Several groups at a time: the same records, each group's in its order."""

import time
from queue import SimpleQueue

import pytest

from infthor_eval.runs import Group, Unit, UnitKey
from infthor_eval.runs.work.executor import run_groups
from model_adapters import Capabilities
from tests.helpers.toy_suite import Adder, Sum, ToySuite, run
from tests.runs.toy_command import request


def groups(n):
    return [
        Group([Unit(UnitKey("t", f"{g}.{u}"), "c", Sum((g, u))) for u in range(3)])
        for g in range(n)
    ]


def test_groups_in_flight_are_done_at_the_same_time_and_each_in_its_order():
    running, most = [], []

    def do(group):
        running.append(group)
        most.append(len(running))
        for unit in group.units:
            time.sleep(0.02)
            yield unit.record("f", unit.payload)
        running.remove(group)

    records = list(run_groups(groups(6), do, 3))
    assert 1 < max(most) <= 3
    assert sorted(record.id for record in records) == sorted(
        u.key.id for g in groups(6) for u in g.units
    )
    for number in range(6):
        assert [r.id for r in records if r.id.startswith(f"{number}.")] == [
            f"{number}.{u}" for u in range(3)
        ]


def test_a_thread_that_finds_the_last_group_taken_ends(monkeypatch):
    class Slow(SimpleQueue):
        def empty(self):
            is_empty = super().empty()
            time.sleep(0.02)
            return is_empty

    monkeypatch.setattr("infthor_eval.runs.work.executor.SimpleQueue", Slow)
    records = list(
        run_groups(
            groups(3), lambda group: (unit.record("f", unit.payload) for unit in group.units), 2
        )
    )
    assert len(records) == 9


def test_an_error_in_a_thread_ends_the_run_with_that_error():
    def do(group):
        yield group.units[0].record("f", group.units[0].payload)
        raise ZeroDivisionError("a bug")

    with pytest.raises(ZeroDivisionError, match="a bug"):
        list(run_groups(groups(5), do, 2))


def test_a_subject_with_several_in_flight_gives_the_same_records(tmp_path):
    class Wide(Adder):
        capabilities = Capabilities(counts_tokens=False, token_ids=False, max_in_flight=2)

    class WideSuite(ToySuite):
        baselines = {"adder": Wide}  # noqa: RUF012

    one, two = run(request(tmp_path / "1"))[0], run(request(tmp_path / "2"), WideSuite())[0]
    assert one.records == two.records
