"""The page of rows, in a browser: what is on it, in which order, on a screen and on a phone."""

import pytest

from infthor_board.page import LeaderboardRow, write_leaderboard
from infthor_board.rows import published_rows
from infthor_eval.rates import Rate
from tests.helpers.browser import Opened

HOSTILE = '</script><img src=x onerror="window.hacked=1">"\'&{{ 7*7 }}<!--\u2028'
SCREEN = {"width": 1400, "height": 1000}
PHONE = {"width": 420, "height": 900}


def row(model, pairs=None, singles=0.5, **more):
    return LeaderboardRow(
        model=model,
        task=more.pop("task", "nieh_mini_twins"),
        shown="the clue frames",
        frames="embedded simulator",
        pairs=None if pairs is None else Rate(pairs, pairs / 2, pairs * 1.1, 100),
        singles=Rate(singles, singles / 2, singles * 1.1, 200),
        **more,
    )


ROWS = [
    row("lab/middle", 0.30, cost=0.5, tokens_read=900.0, engine="vllm 0.9", date="2026-03-01"),
    row("lab/best", 0.62, cost=12.0, tokens_read=100.0, engine="transformers", date="2026-01-01"),
    row("lab/no-pairs", None, 0.9, date="2026-05-01", task="nieh_mini_gt", seconds=1.5),
    row("lab/worst", 0.05, remarks=("is not above what can be guessed",), failed=3, n=604),
]


@pytest.fixture
def open_rows(browser, tmp_path):
    def open_rows(rows, **options):
        path = tmp_path / "page.html"
        write_leaderboard(rows, path, title="A page", version="0.1.0", refused=2)
        return Opened(browser, path, **options)

    return open_rows


def models(tab):
    return tab.locator("tbody tr:visible .model").all_inner_texts()


def test_pairs_are_first_best_on_top_and_none_at_the_end(open_rows):
    tab = open_rows(ROWS).tab
    assert models(tab) == ["lab/best", "lab/middle", "lab/worst", "lab/no-pairs"]
    headings = tab.locator("thead th").all_inner_texts()
    assert headings[:2] == ["model", "pairs, %"]
    assert {"tokens read", "cost, $", "engine", "date", "shown, memory"} <= set(headings)
    assert "2 submissions were refused" in tab.locator("main").inner_text()


def test_a_heading_sorts_and_sorts_the_other_way(open_rows):
    tab = open_rows(ROWS).tab
    cost = tab.locator("thead th[data-key=cost] button")
    cost.click()
    assert models(tab)[:2] == ["lab/middle", "lab/best"]
    assert tab.locator("thead th[data-key=cost]").get_attribute("aria-sort") == "ascending"
    cost.click()
    assert models(tab)[:2] == ["lab/best", "lab/middle"]
    tab.locator("#order").select_option("date")
    assert models(tab)[0] == "lab/no-pairs"


def test_search_task_and_published_rows(open_rows):
    published = published_rows()
    tab = open_rows([*ROWS, *published]).tab
    assert tab.locator("tr.published").count() == len(published) > 5
    assert tab.locator("tr.published .mark").first.inner_text() == "published"
    tab.locator("#published").uncheck()
    assert len(models(tab)) == len(ROWS)
    tab.locator("#task").select_option("nieh_mini_gt")
    assert models(tab) == ["lab/no-pairs"]
    tab.locator("#search").fill("nobody")
    assert models(tab) == []
    assert tab.locator("#none").is_visible()


def test_nothing_is_loaded_and_nothing_of_others_runs(open_rows):
    texts = {"engine": HOSTILE, "by": HOSTILE, "remarks": (HOSTILE,)}
    hostile = row(HOSTILE, 0.2, url="javascript:alert(1)", **texts)
    opened = open_rows([hostile, row("lab/linked", 0.1, url="https://example.org/model")])
    assert opened.errors == []
    assert [it for it in opened.requests if not it.startswith(("file:", "data:"))] == []
    assert opened.tab.evaluate("window.hacked") is None
    assert models(opened.tab)[0].startswith("</script>")
    assert opened.tab.locator("tbody a").evaluate_all("all => all.map(it => it.href)") == [
        "https://example.org/model"
    ]


@pytest.mark.parametrize("size", [SCREEN, PHONE], ids=["1400", "420"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_as_wide_as_the_page_and_readable(open_rows, size, scheme):
    long = row("developer/" + "a-name-that-is-long-" * 6, 0.4, engine="an engine " * 6)
    opened = open_rows([*ROWS, long, *published_rows()], color_scheme=scheme)
    opened.tab.set_viewport_size(size)
    assert opened.tab.evaluate("document.documentElement.scrollWidth") == size["width"]
    assert opened.errors == []
    colours = opened.tab.locator("tbody .model").first.evaluate(
        "it => [getComputedStyle(it).color, getComputedStyle(document.body).backgroundColor]"
    )
    ink, paper = (sum(map(int, it[4:-1].split(", "))) for it in colours)
    assert (ink < paper) == (scheme == "light")
    assert abs(ink - paper) > 450
    before = colours[1]
    opened.tab.locator("#theme").click()
    after = opened.tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert before != after


def test_no_number_or_heading_is_broken_on_a_screen(open_rows):
    counts = {"tokens_read": 1_234_567.0, "cost": 1234.56, "seconds": 12.34, "n": 12_345}
    long = row("lab/long", 0.4, engine="transformers 5.20.2", date="2026-10-01", **counts)
    tab = open_rows([*ROWS, long, *published_rows()]).tab
    heights = {
        key: tab.locator(f"tbody td[data-key={key}]").first.evaluate(
            "it => { const range = document.createRange(); range.selectNodeContents(it);"
            " return new Set([...range.getClientRects()].map(box => box.top)).size; }"
        )
        for key in ("read", "cost", "seconds", "date")
    }
    assert set(heights.values()) == {1}
    for heading in tab.locator("thead button").all():
        words = heading.inner_text().split()
        widest = max(len(word) for word in words)
        assert heading.bounding_box()["width"] > 4.5 * widest


def test_numbers_have_their_names_on_a_phone_and_it_is_sorted_there(open_rows):
    tab = open_rows(ROWS).tab
    tab.set_viewport_size(PHONE)
    assert tab.locator("thead").is_hidden()
    name = tab.locator("tbody td").first.evaluate("it => getComputedStyle(it, '::before').content")
    assert name == '"pairs, %"'
    tab.locator("#order").select_option("cost")
    assert models(tab)[0] == "lab/middle"


def test_the_same_rows_are_the_same_bytes_and_stay_below_100_kb(tmp_path):
    contents = []
    for name, rows in (("a", ROWS), ("b", ROWS[::-1])):
        write_leaderboard(rows, tmp_path / name, title="A page", version="1")
        contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]
    assert len(contents[0]) < 100_000
