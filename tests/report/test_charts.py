"""Charts as values, and drawn for the page: readable on a phone, nothing cut, no markup."""

import re
from xml.etree import ElementTree

import pytest

from infthor_eval.rates import Rate
from infthor_eval.report.charts import (
    Chart,
    Class,
    Point,
    Series,
    class_series,
    counted_classes,
    point_of,
)
from infthor_eval.report.svg import LETTER, WIDTH, draw, ticks_between

LONG = "a run of a very long name, with options (budget=4k, memory=oracle, seed=17) (incomplete)"


def texts(svg):
    """Each text with the pixels where it begins and where it may end."""
    for it in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text"):
        width = LETTER * len(it.text or "")
        x = float(it.get("x"))
        start = {"end": x - width, "middle": x - width / 2}.get(it.get("text-anchor"), x)
        if it.get("transform") is None:
            yield it.text, start, start + width


def rows(classes, *points, **changes):
    """A chart with the points of each series; None where it has none in a class."""
    series = [
        Series(
            f"{LONG} {place}",
            [Point(x, *it) for x, it in enumerate(of_series) if it is not None],
            place,
        )
        for place, of_series in enumerate(points)
    ]
    return Chart("t", "c", ("class", "%"), series, classes=classes, **changes)


@pytest.mark.parametrize(
    ("counts", "label"),
    [
        ([126, 126], "no clue (126)"),
        ([3, 126], "no clue (3 to 126)"),
        ([1000, None, 4], "no clue (4 to 1,000)"),
        ([None], "no clue (0)"),
    ],
)
def test_a_class_has_the_numbers_of_all_runs_beside_its_name(counts, label):
    series = [Series("m", [Point(0, 50, n=n)] if n else []) for n in counts]
    assert counted_classes(["no clue"], series) == [Class(label)]


@pytest.mark.parametrize("n_series", [1, 3, 12])
def test_no_label_is_cut(n_series):
    svg = draw(rows([Class(LONG, "heading", 30.0)], *[[(50, 40, 60, 7)]] * n_series))
    assert all(start >= -1 and end <= WIDTH + 1 for _, start, end in texts(svg))
    words = " ".join(text for text, *_ in texts(svg))
    assert all(word in words for word in LONG.split())


def test_letters_on_a_phone_are_at_least_ten_pixels_high():
    svg = draw(rows([Class("x")], [(50,)]))
    shown = 390 / WIDTH
    sizes = [float(size) for size in re.findall(r'font-size="([\d.]+)"', svg)]
    assert min(sizes) * shown > 9.7


def test_names_are_text():
    svg = draw(rows([Class("</svg><script>x</script>")], [(1,)]))
    names = {it.tag.rpartition("}")[2] for it in ElementTree.fromstring(svg).iter()}
    assert names <= {"svg", "text", "line", "circle", "title"}
    assert "style=" not in svg  # the page's policy lets no element have one


def test_runs_have_shapes_beside_colours():
    svg = draw(rows([Class("x")], *[[(50,)]] * 3))
    names = {it.tag.rpartition("}")[2] for it in ElementTree.fromstring(svg).iter()}
    assert {"circle", "rect", "polygon"} <= names


def test_values_beyond_the_limits_make_the_axis_longer():
    svg = draw(rows([Class("x")], [(-20, -30, 130)]))
    lines = ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}line")
    assert all(0 <= float(line.get(end)) <= WIDTH for line in lines for end in ("x1", "x2"))


def test_the_numbers_of_a_chart_are_all_there():
    chart = rows([Class("x", chance=30.0), Class("y")], [(50, 40, 60, 7), (1,)], [None, (2,)])
    cells = [row.cells for row in chart.table.rows]
    assert [(row[0], *row[2:]) for row in cells] == [
        ("x", "50.00", "[40.00, 60.00]", "30.00", "7"),
        ("y", "1.00", "-", "", ""),
        ("y", "2.00", "-", "", ""),
    ]


@pytest.mark.parametrize("costs", [(1.0, 1000.0), (5.0,), (0.0001, 1e9), (99.0, 101.0)])
def test_points_are_within_the_panel_and_have_a_tick(costs):
    points = [Point(cost, 50, 0, 100) for cost in costs]
    chart = Chart("t", "c", ("tokens", "%"), [Series("a", points)], "log")
    assert all(start >= -1 and end <= WIDTH + 1 for _, start, end in texts(draw(chart)))
    assert len(chart.table.rows) == len(costs)


def test_a_grid_has_a_cell_for_each_class_and_series():
    depths = [Class("0"), Class("0.5")]
    sizes = [Series("8K", [Point(0, 100), Point(1, 0)]), Series("16K", [Point(1, 120)])]
    chart = Chart("t", "c", ("depth", "context"), sizes, "grid", depths)
    assert [row.cells for row in chart.table.rows] == [
        ("0", "100.00", "-"),
        ("0.5", "0.00", "120.00"),
    ]
    svg = draw(chart)
    assert svg.count("<rect") == 4
    assert [text for text, *_ in texts(svg)] == [
        *("depth", "8K", "16K", "0", "100", "-", "0.5", "0", "120", "context")
    ]


def test_steps_have_corners_where_they_rise_and_a_dashed_bound():
    points = [Point(0, 0), Point(1, 0), Point(2, 4, 3, 5)]
    series = [Series("m", points), Series("at most", [Point(2, 8)], 1, is_bound=True)]
    chart = Chart("t", "c", ("step", "reward"), series, "steps")
    svg = draw(chart)
    line, *_ = ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}polyline")
    assert len(line.get("points").split()) == 4
    assert svg.count("stroke-dasharray") == 2  # the bound's line, and that in the legend
    assert chart.description == "at the end: m 4.0; at most 8.0"
    assert chart.table.rows[2].cells == ("m", "2", "4.000", "[3.000, 5.000]")


@pytest.mark.parametrize("ends", [(0, 100), (-3, 3), (0, 0.07), (12, 13000), (5, 5)])
def test_ticks_are_few_and_within(ends):
    ticks = list(ticks_between(*ends))
    assert 1 <= len(ticks) <= 7
    assert all(ends[0] - 1e-6 <= tick <= ends[1] + 1e-6 for tick in ticks)


def columns(chart):
    """Names of a chart's columns, and which have numbers."""
    return [(column.name, column.is_number) for column in chart.table.columns]


def test_names_of_runs_stand_where_there_are_several():
    classes = [Class("x"), Class("y")]
    one = rows(classes, [(50, 40, 60, 7), None])
    assert one.description == "x 50.0; y none"
    assert columns(one)[:2] == [("class", False), ("%", True)]
    two = rows(classes, [(50,), None], [(1,), (2,)])
    assert two.description == f"x {LONG} 0 50.0, {LONG} 1 1.0; y {LONG} 1 2.0"
    assert columns(two)[:3] == [("class", False), ("run", False), ("%", True)]


def test_columns_of_grids_costs_and_steps():
    sizes = [Series("8K", [Point(0, 100)])]
    grid = Chart("t", "c", ("depth", "context"), sizes, "grid", [Class("0")])
    assert columns(grid) == [("depth", False), ("8K", True)]
    costs = Chart("t", "c", ("tokens", "%"), [Series("a", [Point(2000, 50, 40, 60)])], "log")
    assert costs.description == "a 50.0 at 2,000"
    names = ["tokens", "%", "95 % interval"]
    assert columns(costs) == [("curve", False), *((name, True) for name in names)]


def test_shares_are_percents_with_their_intervals():
    rate = Rate(0.25, 0.05, 0.45, 8)
    assert point_of(3, rate, rate.n) == Point(3, 25.0, 5.0, 45.0, 8)
    series = class_series("m", 2, ["x", "y"], {"y": rate})
    assert series == Series("m", [Point(1, 25.0, 5.0, 45.0, 8)], 2)
