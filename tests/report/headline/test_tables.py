"""The table and the charts that a page opens with."""

from infthor_eval.report.exporting import export_tables
from infthor_eval.report.headline.tables import cost_chart, results_chart, results_table
from infthor_eval.report.svg import draw

from .results import make_result


def test_the_table_has_a_row_for_each_run_with_its_cost_beside_its_score():
    results = [make_result("a", 0.5, cost=0.25, link="#run-0"), make_result("b", None)]
    table = results_table(results)
    assert [row.link for row in table.rows] == ["#run-0", ""]
    by_name = dict(zip((column.name for column in table.columns), table.rows[0].cells, strict=True))
    assert (by_name["%"], by_name["blind, %"], by_name["cost, $"]) == ("50.0", "25.0", "0.2500")
    assert table.rows[1].cells[3] == "none answered"
    latex = export_tables([table], "latex")
    assert latex.splitlines()[0] == r"\begin{tabular}{lllrrrrrrr}"
    assert r"a & nieh\_gt & questions right & 50.0 & 25.0–75.0" in latex


def test_the_chart_has_intervals_blind_and_a_row_without_a_score():
    chart = results_chart([make_result("a", 0.5), make_result("b", None)])
    svg = draw(chart)
    assert all(words in svg for words in ("25.0 to 75.0", "blind 25.0", ">none<"))
    assert chart.description == "nieh_gt: questions right, a 50.0; b none"
    (row,) = chart.table.rows
    assert row.cells[1:] == ("50.00", "[25.00, 75.00]", "25.00", "40")


def test_of_many_runs_the_chart_has_the_highest_and_says_so():
    results = [make_result(f"m{number:02}", number / 100) for number in range(60)]
    chart = results_chart(results)
    assert "The 24 highest of 60." in chart.caption
    assert "m59" in draw(chart) and "m35" not in draw(chart)
    assert results_chart([make_result("dead", None)]) is None


def test_scores_stand_against_the_first_cost_that_all_runs_have():
    priced = [make_result(name, 0.5, cost=cost) for name, cost in (("a", 1.0), ("b", 4.0))]
    assert [row.cells[1] for row in cost_chart(priced).table.rows] == ["0.025", "0.1"]
    counted = [*priced, make_result("c", 0.5)]
    assert "tokens read" in draw(cost_chart(counted))
    assert cost_chart(priced[:1]) is None
