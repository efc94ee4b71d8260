"""Summaries of plans: what cannot be read off the runs of the other tests."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.plans.records import StepRecord
from infthor_eval.plans.summary import summarise_plans

from ..helpers.plan_runs import TASK, make_plan_record, make_plans_config


def done_in(n_agent, n_expert, ended="done", index=0):
    record = make_plan_record("t", index, (0, n_expert), ended=ended)
    payload = msgspec.structs.replace(record.payload, steps=(StepRecord(),) * n_agent)
    return msgspec.structs.replace(record, payload=payload)


def path_weighted(records):
    return summarise_plans(make_plans_config(["t"]), records).tasks[TASK].path_weighted.mean


@pytest.mark.parametrize(
    ("n_agent", "n_expert", "ended", "weighted"),
    [
        (4, 4, "done", 1.0),
        (8, 4, "done", 0.5),
        (2, 4, "done", 1.0),
        (4, 4, "step limit", 0.0),
        (0, 4, "no action", 0.0),
    ],
)
def test_a_way_longer_than_the_experts_counts_less(n_agent, n_expert, ended, weighted):
    assert path_weighted([done_in(n_agent, n_expert, ended)]) == weighted


@given(
    st.lists(
        st.tuples(st.integers(1, 30), st.integers(1, 30), st.booleans()), min_size=1, max_size=8
    )
)
def test_it_is_never_above_the_share_of_completed_plans(plans):
    records = [
        done_in(n_agent, n_expert, "done" if done else "step limit", index)
        for index, (n_agent, n_expert, done) in enumerate(plans)
    ]
    task = summarise_plans(make_plans_config(["t"]), records).tasks[TASK]
    assert 0 <= task.path_weighted.mean <= task.success["total"].mean + 1e-12
