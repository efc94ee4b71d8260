"""A browser to open pages in: one for all tests of a process, as Playwright cannot be started twice
in it."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.report.web.page import Page, write_page

__all__ = ["Opened", "browser", "open_page"]

_BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    path = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if path is None:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


class Opened:
    """A page in a browser.

    Attributes:
        tab: the browser's tab.
        errors: messages of what went wrong in it.
        requests: addresses that it asked for.
    """

    def __init__(self, browser: Any, path: Path, **options: Any) -> None:
        self.tab = browser.new_page(viewport={"width": 1400, "height": 1000}, **options)
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.tab.on(
            "console",
            lambda message: self.errors.append(message.text) if message.type == "error" else None,
        )
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.goto(path.as_uri())


@pytest.fixture
def open_page(browser: Any, tmp_path: Path) -> Callable[..., Opened]:
    """Writes a page and opens it from its file."""

    def open_page(page: Page, **options: Any) -> Opened:
        path = tmp_path / "report.html"
        write_page(page, path)
        return Opened(browser, path, **options)

    return open_page
