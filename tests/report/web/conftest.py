"""Runs that pages are made of, and a browser to open these in."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.cli import main
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.report.runs import read_report_runs
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.report.web.page import Page, write_page
from infthor_eval.suites import find_presenter, find_suite

HOSTILE = '</script><img src=x onerror="window.hacked=1">"\'&{{ 7*7 }}<!--\u2028'
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def nieh_runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of runs on the bundled set: the key, and a guesser."""
    output = tmp_path_factory.mktemp("nieh")
    data = packaged_folder("sets/nieh_mini")
    words = ("--model", "oracle,blind", "--tasks", "nieh_mini_gt,nieh_haystack_8k", "--data", data)
    with pytest.raises(SystemExit) as ended:
        main([*map(str, words), "--tokens-per-frame", "100", "--output", str(output)])
    assert ended.value.code == 0
    return sorted(folder for model in ("oracle", "blind") for folder in (output / model).iterdir())


@pytest.fixture(scope="session")
def make_page() -> Callable[..., Page]:
    """The page of runs in some folders."""

    def make(*folders: Path, **options: Any) -> Page:
        return build_page(read_report_runs(folders, find_suite, find_presenter), PageRequest(**options))

    return make


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install playwright")
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
        self.tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
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
