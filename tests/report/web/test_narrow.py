"""The page on a phone, 420 pixels wide."""

import pytest

from infthor_eval.report.web.sections import Section
from infthor_eval.tables import Column, Row, Table

from .conftest import changed

PHONE = {"width": 420, "height": 900}


@pytest.fixture
def phone(page, open_page):
    def phone(**changes):
        opened = open_page(changed(page, **changes))
        opened.tab.set_viewport_size(PHONE)
        return opened.tab

    return phone


def test_nothing_is_wider_than_the_page_and_every_section_has_its_link(phone, page):
    tab = phone(title="a title of a run with a name that is long " * 3)
    assert tab.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    links = tab.locator("nav a")
    assert links.all_inner_texts() == [
        *(section.title for section in page.sections),
        "Samples",
        "Settings of the runs",
    ]
    for at in range(links.count()):
        box = links.nth(at).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"]


def test_replies_have_the_width_of_the_page_and_numbers_their_names(phone):
    tab = phone()
    assert tab.locator("#sample .reply").first.bounding_box()["width"] > 350
    assert tab.locator("#sample .results thead").is_hidden()
    name = tab.locator("#sample .results td.n").first.evaluate(
        "it => getComputedStyle(it, '::before').content"
    )
    assert name == '"strict "'


def test_tables_are_a_block_a_row_with_every_column_on_the_screen(phone, page):
    wide = Table("", tuple(Column(f"column {number}") for number in range(20)), (Row(("1",) * 20),))
    tab = phone(sections=[Section("wide", "Wide", tables=(wide,)), *page.sections])
    cells = tab.locator("#wide td")
    boxes = [cells.nth(at).bounding_box() for at in range(cells.count())]
    assert len(boxes) == 20
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"] for box in boxes)
    name = cells.nth(3).evaluate("it => getComputedStyle(it, '::before').content")
    assert name == '"column 3 "'
    charts = tab.locator("figure.chart svg")
    for at in range(charts.count()):
        box = charts.nth(at).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"]


def test_tables_that_scroll_say_so(phone, page):
    wide = Table("", tuple(Column(f"column {number}") for number in range(20)), (Row(("1",) * 20),))
    narrow = Table("", (Column("column"),), (Row(("1",)),))
    tab = phone(sections=[Section("wide", "Wide", tables=(wide, narrow)), *page.sections])
    tab.set_viewport_size({"width": 800, "height": 900})
    scrolls = tab.locator("#wide .scroll")
    tab.wait_for_selector("#wide .scroll[data-wide]")
    assert [scrolls.nth(at).get_attribute("data-wide") for at in range(2)] == ["", None]
    assert "scrolls sideways" in scrolls.first.evaluate(
        "it => getComputedStyle(it, '::before').content"
    )


def test_parts_of_a_section_have_no_link_and_long_titles_leave_room_for_the_others(page, open_page):
    sections = [
        page.sections[0],
        Section("long", "a title that is long " * 10, notes=("x",)),
        Section("part", "part of it", notes=("x",), is_linked=False),
        Section("last", "Last", notes=("x",)),
    ]
    tab = open_page(changed(page, sections=sections, title="long title " * 20)).tab
    links = [text[:7] for text in tab.locator("nav a").all_inner_texts()]
    assert links == ["Results", "a title", "Last", "Samples", "Setting"]
    box = tab.locator("nav a").last.bounding_box()
    assert box["x"] + box["width"] < tab.locator("#theme").bounding_box()["x"]
