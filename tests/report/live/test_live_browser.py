"""The page on a run, in a browser: it grows with the run, says what became of it, and shows text as
text."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.nieh.records import RECORDS
from infthor_eval.pages.server import PageServer, require_page_extra, serve_pages
from infthor_eval.runs.journals.journal import Journal
from tests.helpers.nieh_runs import make_record
from tests.report.live.conftest import header_of
from tests.report.web.conftest import HOSTILE

try:
    require_page_extra()
except UsageError as error:
    pytest.skip(str(error), allow_module_level=True)
from infthor_eval.report.live.state import live_routes

EXPECT_MS = 60_000  # a guard against hangs


@pytest.fixture
def server(live) -> Iterator[PageServer]:
    with serve_pages(live_routes(live)) as running:
        yield running


@pytest.fixture
def tab(browser: Any, server: PageServer) -> Iterator[Any]:
    """A tab that is on the page; nothing may have gone wrong in it at the end."""
    opened = browser.new_page(viewport={"width": 1400, "height": 1000})
    problems: list[str] = []
    opened.on(
        "console",
        lambda message: problems.append(message.text) if message.type == "error" else None,
    )
    opened.on("pageerror", lambda error: problems.append(str(error)))
    opened.goto(server.address)
    yield opened
    opened.close()
    assert problems == []


def wait_for(tab: Any, selector: str, text: str) -> None:
    tab.locator(selector).get_by_text(text, exact=False).first.wait_for(timeout=EXPECT_MS)


def test_a_page_that_is_open_before_the_run_grows_with_it(tab: Any, open_journal) -> None:
    wait_for(tab, "#status", "has not started")
    with open_journal() as journal:
        wait_for(tab, "#count", "0 of 8 (0 %)")
        journal.append(make_record(0, "Sofa", ("Sofa",)))
        wait_for(tab, "#count", "1 of 8 (12 %)")
        wait_for(tab, "#metrics", "100.0")
        journal.append(make_record(1, "Bed", ("Sofa",)))
        journal.append(make_record(2, None, ("Bed",), failure="the model fell over"))
        wait_for(tab, "#count", "3 of 8 (37 %), 1 failed")
        wait_for(tab, "#failures", "the model fell over")
        wait_for(tab, "#reasons", "1 × the model fell over")
        wait_for(tab, "#metrics", "50.0 of 2 answered")
        replies = tab.locator(".sample .reply").all_text_contents()
        assert replies == ["the model fell over", "Bed", "Sofa"]
        assert tab.title() == "3 / 8 m"
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_killed_run_is_said_to_be_none_that_goes_on(tab: Any, tmp_path: Path) -> None:
    if not Path("/proc/locks").is_file():
        pytest.skip("this system has no list of locks")
    program = (
        "import sys, time\nfrom pathlib import Path\n"
        "from infthor_eval.nieh.records import RECORDS\n"
        "from infthor_eval.runs.journals.journal import Journal\n"
        "from tests.helpers.nieh_runs import make_record\n"
        "from tests.report.live.conftest import header_of\n"
        "with Journal(Path(sys.argv[1]), header_of(), RECORDS) as journal:\n"
        "    journal.append(make_record(0, 'Sofa', ('Sofa',)))\n    time.sleep(600)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path / "results/m/nieh-1")],
        cwd=Path(__file__).parents[3],
    )
    try:
        wait_for(tab, "#count", "1 of 8")
        wait_for(tab, "#status", "running")
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_for(tab, "#status", "not running")
    wait_for(tab, "#problem", "the run was killed, or goes on elsewhere")
    assert tab.locator("#count").text_content() == "1 of 8 (12 %)"


def test_hostile_text_is_text(tab: Any, tmp_path: Path) -> None:
    folder = tmp_path / "results" / "m" / "<img src=x onerror=window.hacked=1>"
    with Journal(folder, header_of(HOSTILE), RECORDS, 0) as journal:
        journal.append(make_record(0, HOSTILE, (HOSTILE,), question=HOSTILE))
        journal.append(make_record(1, None, ("Bed",), failure=HOSTILE))
        wait_for(tab, "#count", "2 of 8")
    assert tab.evaluate("window.hacked") is None
    assert tab.locator("body img, main script").count() == 0
    assert tab.locator("#name").text_content() == HOSTILE
    assert HOSTILE.strip() in tab.locator(".sample .q").last.text_content()


def test_a_wrong_token_shows_nothing_of_the_run(browser: Any, server: PageServer, begun) -> None:
    opened = browser.new_page()
    for path in ("wrong/", "", "wrong/state.json"):
        answer = opened.goto(f"http://127.0.0.1:{server.port}/{path}")
        assert answer.status == 403
        assert "Refused: the address does not hold the token" in opened.content()
        assert "Sofa" not in opened.content()
    opened.close()


def test_a_page_whose_server_has_ended_says_so(browser: Any, live, begun) -> None:
    with serve_pages(live_routes(live)) as server:
        opened = browser.new_page()
        opened.goto(server.address)
        wait_for(opened, "#count", "1 of 8")
    wait_for(opened, "#status", "page has ended")
    wait_for(opened, "#problem", "the run is not affected")
    wait_for(opened, "#newest", "Sofa")  # what was there remains
    opened.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_wider_than_a_phone(
    browser: Any, server: PageServer, open_journal, scheme: str
) -> None:
    with open_journal(name="a-model-with-a-long-name" * 3) as journal:
        journal.append(make_record(0, "Sofa " * 200, ("Sofa",)))
        journal.append(make_record(1, "x" * 500, ("Sofa",)))
        journal.append(make_record(2, None, ("Sofa",), failure="x" * 500))
        opened = browser.new_page(viewport={"width": 420, "height": 900}, color_scheme=scheme)
        opened.goto(server.address)
        wait_for(opened, "#count", "3 of 8")
        assert opened.evaluate("document.documentElement.scrollWidth") == 420
        opened.close()
