"""Summaries of plans: what cannot be read off the runs of the other tests."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.plans.records import StepRecord
from infthor_eval.plans.suite import PlansSuite
from infthor_eval.plans.summary import summarise_plans
from infthor_eval.runs import RunSummary

from ..helpers.plan_runs import TASK, make_plan_record, make_plans_config, make_plans_run


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


def test_tables_say_whose_actions_were_drawn():
    def run(label, temperature, **model):
        records = [make_plan_record("t", 0, (0, 3))]
        header = make_plans_run(label, records, model={"name": label, **model}).header
        task = msgspec.structs.replace(
            header.config.tasks[TASK], decoding={"temperature": temperature}
        )
        config = msgspec.structs.replace(header.config, tasks={TASK: task})
        header = msgspec.structs.replace(header, config=config)
        return RunSummary(header, summarise_plans(config, records))

    runs = [
        run("hot", 1.0),
        run("greedy", 0.0),
        run("warm", 0.5),
        run("warmer", 0.5),
        run("planner", 1.0, baseline="planner"),
        run("a person", 1.0, reader="terminal"),
    ]
    for tables in (PlansSuite().overview(runs), PlansSuite().tables(runs)):
        assert [note for table in tables for note in table.notes if "Drawn" in note] == [
            "Drawn at temperature 1, not the likeliest actions (--greedy): hot.",
            "Drawn at temperature 0.5, not the likeliest actions (--greedy): warm, warmer.",
        ]
    (overview,) = PlansSuite().overview(runs[1:2])
    assert not any("Drawn" in note for note in overview.notes)
