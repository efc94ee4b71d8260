"""Runs that pages are made of."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.cli import main
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.report.web.page import Page
from infthor_eval.run import open_runs
from infthor_eval.storage.folders import packaged_folder
from tests.helpers.browser import Opened

HOSTILE = '</script><img src=x onerror="window.hacked=1">"\'&{{ 7*7 }}<!--\u2028'


@pytest.fixture(scope="session")
def nieh_runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of runs on the bundled set: the key, and a guesser."""
    output = tmp_path_factory.mktemp("nieh")
    data = packaged_folder("sets/nieh_mini")
    words = ("--model", "oracle,blind", "--tasks", "nieh_mini_gt,nieh_haystack_8k", "--data", data)
    with pytest.raises(SystemExit) as ended:
        main([*map(str, words), "--tokens-per-frame", "100", "--out", str(output)])
    assert ended.value.code == 0
    return sorted(folder for model in ("oracle", "blind") for folder in (output / model).iterdir())


@pytest.fixture(scope="session")
def page(make_page: Callable[..., Page], nieh_runs: list[Path]) -> Page:
    """The page of those runs, with the frames of the set."""
    return make_page(*nieh_runs, data=packaged_folder("sets/nieh_mini"))


@pytest.fixture
def open_page(open_page: Callable[..., Opened]) -> Iterator[Callable[..., Opened]]:
    """Writes a page and opens it from its file; nothing may have gone wrong in it at the end."""
    opened: list[Opened] = []

    def open_and_keep(page: Page, **options: Any) -> Opened:
        opened.append(open_page(page, **options))
        return opened[-1]

    yield open_and_keep
    assert [error for each in opened for error in each.errors] == []


@pytest.fixture
def tab(page: Page, open_page: Callable[..., Opened]) -> Any:
    """A tab of a browser with the page."""
    return open_page(page).tab


def changed(page: Page, **changes: Any) -> Page:
    """The same page with other parts."""
    return page.__class__(**(vars(page) | changes))


@pytest.fixture(scope="session")
def make_page() -> Callable[..., Page]:
    """The page of runs in some folders."""

    def make(*folders: Path, **options: Any) -> Page:
        return build_page(open_runs(folders), PageRequest(**options))

    return make
