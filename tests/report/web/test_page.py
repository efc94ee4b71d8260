"""The file: whatever samples hold stays text, and nothing is fetched."""

import json
import re
from html.parser import HTMLParser

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.report.web.page import About, Page, SuiteLabels, write_page
from infthor_eval.report.web.samples import PageSample, SampleResult
from infthor_eval.report.web.sections import Section
from infthor_eval.tables import Column, Row, Table

from .conftest import HOSTILE

TEXT = st.text(st.characters(blacklist_categories=["Cs"]), min_size=1, max_size=40) | st.just(
    HOSTILE
)


def page_of(text, n_samples=1):
    result = SampleResult("right", text, {"strict": 1.0}, text)
    sample = PageSample("nieh", text, text, text, text, (result,), text, text)
    table = Table(text, (Column(text),), (Row((text,)),), (text,))
    about = About(text, ((text, text),), text, text)
    labels = {"nieh": SuiteLabels((0,), text, text, True)}
    sections = [Section("key", text, (), (table,), (text,))]
    return Page(text, "0", [about], labels, sections, [sample] * n_samples, ["strict"], [])


class Elements(HTMLParser):
    """Names of the elements of a page, and what its data say."""

    def __init__(self, text):
        super().__init__()
        self.names, self.attributes, self.data = [], [], ""
        self._in_data = False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        self.attributes += [name for name, _ in attrs]
        self._in_data = dict(attrs).get("id") == "data"

    def handle_data(self, data):
        if self._in_data:
            self.data += data

    def handle_endtag(self, tag):
        self._in_data = False


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"

    def written(page):
        write_page(page, path)
        return path.read_text(encoding="utf-8")

    return written


@settings(max_examples=40)
@given(TEXT)
def test_no_text_becomes_an_element_and_the_data_come_out_as_they_went_in(written, text):
    plain, hostile = (Elements(written(page_of(it))) for it in ("text", text))
    assert hostile.names.count("img") == 0
    assert hostile.names.count("script") == plain.names.count("script") == 4
    assert not any(name.startswith("on") for name in hostile.attributes)
    (sample,) = json.loads(hostile.data)["samples"]
    assert (sample["title"], sample["results"][0]["reply"]) == (text, text)


def test_nothing_is_fetched(written):
    text = written(page_of("text"))
    assert not re.search(r'(?:src|href)="(?!#|data:)', text)
    assert "default-src 'none'" in text


def test_equal_pages_are_equal_files(written):
    assert written(page_of("text")) == written(page_of("text"))


def test_a_page_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be written"):
        write_page(page_of("text"), tmp_path / "file" / "report.html")
