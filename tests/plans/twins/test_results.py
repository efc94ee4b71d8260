"""Results of pairs, of records by hand."""

import msgspec
import pytest
from msgspec import UNSET

from infthor_eval.household.first_place import FirstPlace
from infthor_eval.plans.records import StepRecord, TwinRecord
from infthor_eval.plans.suite import PlansSuite
from infthor_eval.plans.summary import summarise_plans
from infthor_eval.plans.twins.results import first_place_score, twin_results
from infthor_eval.report.suites.plans import PlansPresenter
from infthor_eval.runs import RunSummary

from ...helpers.plan_runs import TASK, make_plan_record, make_plans_config, make_plans_run

OWN, TWIN, OTHER = FirstPlace.OWN, FirstPlace.TWIN, FirstPlace.OTHER


def world(pair, side, first, *, found=True, put=True, n_steps=4, n_opened=0, excluded=None):
    """The two plans of a world's final task; the planner finds the object in 4 actions."""
    name = f"{pair}-{side}"
    base = pair[0]
    ends = "done", "step limit"
    find = make_plan_record(name, 7, (0, 4), ended=ends[not found], excluded=excluded)
    bring = make_plan_record(name, 8, (4, 6), ended=ends[not put], excluded=excluded)
    twin = TwinRecord(pair=pair, base=base, finds=True, first=first, n_opened=n_opened)
    steps, replace = (StepRecord(),) * n_steps, msgspec.structs.replace
    found_in = replace(find.payload, twin=twin, steps=steps)
    brought = replace(bring.payload, twin=TwinRecord(pair=pair, base=base))
    return [replace(find, payload=found_in), replace(bring, payload=brought)]


def results(*worlds):
    return twin_results([record for plans in worlds for record in plans])


def test_a_pair_is_right_if_both_worlds_are():
    twins = results(
        world("a1", 0, OWN),
        world("a1", 1, OWN),
        world("a2", 0, OWN),
        world("a2", 1, TWIN),
        world("b1", 0, OTHER, found=False, put=False),
        world("b1", 1, None, found=False, put=False),
        world("b2", 0, OWN),
        world("b2", 1, OWN, put=False),
    )
    assert (twins.n_pairs, twins.n_incomplete) == (4, 0)
    assert twins.pair_accuracy.mean == 0.5
    assert twins.pair_success.mean == 0.5  # a1, a2
    assert twins.accuracy.mean == 5 / 8
    assert twins.one_of_two.mean == 0.25
    assert twins.same_place.mean == 0.25
    assert twins.nowhere.mean == 1 / 8
    assert twins.pair_accuracy.low is not None
    assert (twins.pairs_exchanged.mean, twins.net_pairs.mean) == (0.0, 0.5)


def test_who_goes_to_the_other_worlds_place_in_both_has_a_pair_less():
    twins = results(
        *(world("a1", side, OWN) for side in (0, 1)),
        *(world(pair, side, TWIN) for pair in ("b1", "c1") for side in (0, 1)),
    )
    assert (twins.pair_accuracy.mean, twins.pairs_exchanged.mean) == (1 / 3, 2 / 3)
    assert twins.net_pairs.mean == pytest.approx(-1 / 3)
    assert twins.net_pairs.low == -1.0  # of a difference, over bases


def test_the_scores_of_pairs_have_the_mean_of_the_results():
    worlds = (
        world("a1", 0, OWN),
        world("a1", 1, OWN),
        world("a2", 0, OWN),
        world("a2", 1, TWIN),
        world("b1", 0, OWN),
        world("b1", 1, OWN, excluded="the object is gone"),
    )
    records = [record for plans in worlds for record in plans]
    scores = list(PlansPresenter().group_scores(records))
    assert scores == [
        ("net_pairs", "a1", "a", 1.0),
        ("pair_accuracy", "a1", "a", 1.0),
        ("pairs_exchanged", "a1", "a", 0.0),
        ("net_pairs", "a2", "a", 0.0),
        ("pair_accuracy", "a2", "a", 0.0),
        ("pairs_exchanged", "a2", "a", 0.0),
    ]
    assert twin_results(records).pair_accuracy.mean == 0.5


def test_intervals_are_of_what_pairs_were_made_of():
    one_base = results(
        *(world(f"a{n}", side, OWN if n < 3 else TWIN) for n in range(6) for side in (0, 1))
    )
    assert one_base.pair_accuracy.n == 6
    assert one_base.pair_accuracy.low is None  # a single cluster


@pytest.mark.parametrize("firsts", [(OWN, TWIN), (TWIN, OWN)])
def test_who_says_the_same_to_both_has_no_pair(firsts):
    twins = results(*(world("a1", side, first) for side, first in enumerate(firsts)))
    assert twins.pair_accuracy.mean == 0.0
    assert twins.same_place.mean == twins.one_of_two.mean == 1.0


def test_a_wrong_place_in_both_is_not_the_same_place():
    twins = results(world("a1", 0, TWIN), world("a1", 1, TWIN))
    assert twins.same_place.mean == twins.pair_accuracy.mean == 0.0


def test_excess_is_of_worlds_where_the_object_is_found_and_opened_of_all():
    twins = results(
        world("a1", 0, OWN, n_steps=7),
        world("a1", 1, OWN, n_steps=4, n_opened=3),
        world("b1", 0, OTHER, n_steps=50, found=False, n_opened=1),
        world("b1", 1, OWN, n_steps=5),
    )
    assert twins.excess.mean == pytest.approx(4 / 3)
    assert twins.excess.n == 3
    assert twins.opened.mean == 1.0
    assert twins.opened.low < 0  # no share


def test_a_pair_with_a_world_left_out_does_not_count():
    twins = results(
        world("a1", 0, OWN),
        world("a1", 1, OWN, excluded="the scene has no such object"),
        world("b1", 0, OWN),
    )
    assert (twins.n_pairs, twins.n_incomplete) == (0, 2)
    assert twins.pair_accuracy is None


def test_without_twins_nothing_is_written():
    records = [make_plan_record("t", 0, (0, 3))]
    task = summarise_plans(make_plans_config(["t"]), records).tasks[TASK]
    assert task.twins is UNSET
    assert "twins" not in msgspec.to_builtins(task)
    assert first_place_score(records[0].payload) == {}


def test_pairs_are_the_primary_metric_and_a_column_only_where_there_are_twins():
    suite = PlansSuite()
    twins = [*world("a1", 0, OWN), *world("a1", 1, TWIN)]
    others = [make_plan_record("t", 0, (0, 3))]
    for records, rate in ((twins, 0.0), (others, 1.0)):
        run = make_plans_run("a run", records)
        summary = summarise_plans(run.header.config, records)
        assert suite.primary_metrics(summary)[TASK].mean == rate
        runs = [RunSummary(run.header, summary)]
        (overview,) = suite.overview(runs)
        has_pairs = "net pairs, %" in [column.name for column in overview.columns]
        titles = [table.title for table in suite.tables(runs)]
        assert has_pairs == ("Twins: the place looked at first" in titles) == (records is twins)
    assert suite.scores(twins[0])["first_place"] == 1.0
    assert suite.scores(twins[2])["first_place"] == 0.0
    assert "first_place" not in suite.scores(twins[1])
