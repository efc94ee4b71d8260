"""Runs of bundled twins in the embedded simulator."""

import json

import pytest

from infthor_eval.household.first_place import FirstPlace
from infthor_eval.plans.twins.results import twin_results
from infthor_eval.runs import execute

pytestmark = pytest.mark.usefixtures("shared_simulators")


@pytest.fixture
def run(prepare_run):
    """Runs a subject on one pair of the bundled set."""

    def run(model, **options):
        settings = {"tasks": ("infthor_twins_mini",), "data": None, "limit": 1, **options}
        return execute(prepare_run(model, **settings))

    return run


def twins(outcome):
    return outcome.summary.summary.tasks["infthor_twins_mini"].twins


def test_a_limit_takes_both_worlds_of_a_pair_and_the_planner_has_it(run, tmp_path):
    outcome = run("planner", output=tmp_path / "out")
    pairs = {record.payload.twin.pair for record in outcome.records}
    assert len(pairs) == 1
    assert len({record.cluster for record in outcome.records}) == 2
    assert [record.payload.kind for record in outcome.records] == ["PickupObject", "PutObject"] * 2
    found = twins(outcome)
    assert (found.n_pairs, found.n_incomplete) == (1, 0)
    assert found.pair_accuracy.mean == found.pair_success.mean == 1.0
    assert found.excess.mean == found.opened.mean == 0.0
    (results,) = (tmp_path / "out").rglob("results.json")
    document = json.loads(results.read_text())
    assert document["primary_metrics"]["infthor_twins_mini"]["mean"] == 1.0
    summary = document["summary"]["tasks"]["infthor_twins_mini"]
    assert summary["twins"]["pair_accuracy"]["n"] == 1


@pytest.mark.parametrize("model", ["scripted", "history"])
def test_who_does_not_remember_has_no_pair(run, model):
    outcome = run(model)
    assert twins(outcome).pair_accuracy.mean == 0.0
    assert twins(outcome) == twin_results(outcome.records)


def test_the_place_is_of_the_plan_that_finds_the_object(run):
    outcome = run("planner")
    firsts = [(record.payload.twin.finds, record.payload.twin.first) for record in outcome.records]
    assert firsts == [(True, FirstPlace.OWN), (False, None)] * 2
