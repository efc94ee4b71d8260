"""Charts of the page: readable on a phone, nothing cut, no markup from names."""

import re
from xml.etree import ElementTree

import pytest

from infthor_eval.report.svg.dots import Dot, DotRow, DotsChart, class_row, dots_chart
from infthor_eval.report.svg.drawing import LETTER, WIDTH, Series, ticks_between
from infthor_eval.report.svg.points import Point, PointsChart, points_chart

LONG = "a run of a very long name, with options (budget=4k, memory=oracle, seed=17) (incomplete)"


def texts(svg):
    """Each text with the pixels where it begins and where it may end."""
    for it in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text"):
        width = LETTER * len(it.text or "")
        x = float(it.get("x"))
        start = {"end": x - width, "middle": x - width / 2}.get(it.get("text-anchor"), x)
        if it.get("transform") is None:
            yield it.text, start, start + width


def dots(rows, n_series=1, **changes):
    series = [Series(f"{LONG} {number}", number) for number in range(n_series)]
    fields = {"title": "t", "caption": "c", "axis": "%", "label": "class"}
    return dots_chart(DotsChart(**fields, series=series, rows=rows, **changes))


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
    row = class_row("no clue", [n and Dot(50, n=n) for n in counts])
    assert row.label == label


@pytest.mark.parametrize("n_series", [1, 3, 12])
def test_no_label_is_cut(n_series):
    rows = [DotRow(LONG, [Dot(50, 40, 60, 7)] * n_series, 30.0, "heading")]
    svg = dots(rows, n_series).svg
    assert all(start >= -1 and end <= WIDTH + 1 for _, start, end in texts(svg))
    words = " ".join(text for text, *_ in texts(svg))
    assert all(word in words for word in LONG.split())


def test_letters_on_a_phone_are_at_least_ten_pixels_high():
    svg = dots([DotRow("x", [Dot(50)])]).svg
    shown = 390 / WIDTH
    sizes = [float(size) for size in re.findall(r'font-size="([\d.]+)"', svg)]
    assert min(sizes) * shown > 9.7


def test_names_are_text():
    svg = dots([DotRow("</svg><script>x</script>", [Dot(1)])]).svg
    names = {it.tag.rpartition("}")[2] for it in ElementTree.fromstring(svg).iter()}
    assert names <= {"svg", "text", "line", "circle", "title"}
    assert "style=" not in svg  # the page's policy lets no element have one


def test_runs_have_shapes_beside_colours():
    svg = dots([DotRow("x", [Dot(50)] * 3)], 3).svg
    names = {it.tag.rpartition("}")[2] for it in ElementTree.fromstring(svg).iter()}
    assert {"circle", "rect", "polygon"} <= names


def test_values_beyond_the_limits_make_the_axis_longer():
    svg = dots([DotRow("x", [Dot(-20, -30, 130)])]).svg
    lines = ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}line")
    assert all(0 <= float(line.get(end)) <= WIDTH for line in lines for end in ("x1", "x2"))


def test_the_numbers_of_a_chart_are_all_there():
    rows = [DotRow("x", [Dot(50, 40, 60, 7), None], 30.0), DotRow("y", [Dot(1), Dot(2)])]
    cells = [row.cells for row in dots(rows, 2).table.rows]
    assert [(row[0], *row[2:]) for row in cells] == [
        ("x", "50.00", "[40.00, 60.00]", "30.00", "7"),
        ("y", "1.00", "-", "", ""),
        ("y", "2.00", "-", "", ""),
    ]


@pytest.mark.parametrize("costs", [(1.0, 1000.0), (5.0,), (0.0001, 1e9), (99.0, 101.0)])
def test_points_are_within_the_panel_and_have_a_tick(costs):
    points = [Point(cost, Dot(50, 0, 100)) for cost in costs]
    chart = points_chart(PointsChart("t", "c", ("tokens", "%"), {"a": points}))
    assert all(start >= -1 and end <= WIDTH + 1 for _, start, end in texts(chart.svg))
    assert len(chart.table.rows) == len(costs)


@pytest.mark.parametrize("ends", [(0, 100), (-3, 3), (0, 0.07), (12, 13000), (5, 5)])
def test_ticks_are_few_and_within(ends):
    ticks = list(ticks_between(*ends))
    assert 1 <= len(ticks) <= 7
    assert all(ends[0] - 1e-6 <= tick <= ends[1] + 1e-6 for tick in ticks)
