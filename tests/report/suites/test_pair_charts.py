"""The memory curves of pairs of twins: what is drawn, and the numbers of the figure."""

from pathlib import Path

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.report.figures import save_figure
from infthor_eval.report.presenter import FigureRequest
from infthor_eval.report.suites.nieh import NiehPresenter
from infthor_eval.report.svg import draw
from infthor_eval.run import Run
from infthor_eval.runs import RunSummary

from ...helpers.nieh_runs import make_config, make_header, make_record, make_twins


def make_run(label, records):
    header = make_header(make_config(), label)
    suite = NiehSuite()
    return Run.held(Path(label), suite, RunSummary.of(suite, header, records), records)


@pytest.fixture(scope="module")
def runs():
    """Of the first run, both near pairs are right and no far one; of the second, none is."""
    places = ((0, 10, 2), (1, 20, 2), (2, 60, 8), (3, 70, 8))
    remembers = []
    guesses = []
    for number, *shown in places:
        replies = ("bowl", "sofa" if number < 2 else "bowl")
        remembers += make_twins(number, replies, f"t{number}", *shown)
        guesses += make_twins(number, ("bowl", "bowl"), f"t{number}", *shown)
    return [make_run("remembers", remembers), make_run("guesses", guesses)]


def test_a_chart_per_curve_with_several_classes_opens_the_page(runs):
    section = NiehPresenter().opening(runs)
    titles = [chart.title for chart in section.charts]
    assert titles == [
        "nieh_gt: net pairs of twins, by frames between the last clue and the end of the "
        "trajectory",
        "nieh_gt: net pairs of twins, by number of frames shown",
    ]  # how old their evidence is, these records do not say
    assert section.charts[0].description == (
        "remembers 100.0 % at 0-49, 0.0 % at 50-99; guesses 0.0 % at 0-49, 0.0 % at 50-99"
    )
    assert all(name in draw(section.charts[1]) for name in ("remembers", "guesses", "(2)"))
    assert section.tables[0].title.startswith("Twins: net pairs")


def test_without_twins_nothing_opens_the_page(runs):
    alone = make_run("alone", [make_record(0, "mug"), make_record(1, "cup")])
    presenter = NiehPresenter()
    assert presenter.opening([alone]) is None
    assert presenter.measure_of("nieh_gt", alone.summary.summary) == "questions right"
    assert presenter.measure_of("nieh_gt", runs[0].summary.summary) == "net pairs"
    with pytest.raises(UsageError, match="no task of these runs has pairs of twins"):
        presenter.figures["pairs"].build([alone], FigureRequest())


def test_the_figure_has_a_panel_per_curve_and_a_row_per_class(runs, tmp_path):
    figure = NiehPresenter().figures["pairs"]
    result = figure.build(runs, FigureRequest())
    rows = {row.cells[:3]: (str(row.cells[3]), row.cells[4]) for row in result.table.rows}
    by_distance = "frames between the last clue and the end of the trajectory"
    assert rows["remembers", by_distance, "0-49"] == ("100.0 [all equal]", "2")
    assert rows["guesses", "number of frames shown", "<=8"] == ("0.0 [all equal]", "2")
    assert len(rows) == 2 * (2 + 2)
    paths = save_figure(result.plot, tmp_path, "pairs")
    assert [path.name for path in paths] == ["pairs.png", "pairs.svg"]
    svg = paths[1].read_text()
    assert svg.count("net pairs (%)") == 1  # one scale for all panels
    assert "4 pairs of 4 trajectories" in svg
    with pytest.raises(UsageError, match="other of these runs has pairs"):
        figure.build(runs, FigureRequest(task="other"))
