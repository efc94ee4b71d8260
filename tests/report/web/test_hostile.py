"""Hostile names, questions, replies and frames, from the set to the browser: text, never run."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from PIL import Image

from infthor_eval.cli import main
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.validation import JudgedQuestion
from infthor_eval.report.inspection import write_inspection_page
from infthor_eval.runs.journals.shards import read_run_log
from tests.helpers.browser import Opened
from tests.helpers.journals import write_journal

from .conftest import HOSTILE

# A name of a frame can have no slash; its markup needs none.
FRAME = "\"'><img src=x onerror=window.hacked=1>&{{7*7}}.png"
REPLIES = (
    HOSTILE,
    "<svg onload=window.hacked=1>",
    "<style>*{display:none}</style>",
    '" style="position:fixed;inset:0" x="',
    "javascript:window.hacked=1",
    "</style><script>window.hacked=1</script>",
    "]]><script>window.hacked=1</script>",
    "\U0001f600\u202e\u2066",
)
MARKUP = "img[onerror], img[src=x], svg[onload], main style"


@pytest.fixture(scope="module")
def hostile_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A set of two trajectories whose frames, objects and questions are hostile."""
    root = tmp_path_factory.mktemp("hostile") / "set"
    for number in range(2):
        images = root / "metadata" / f"t{number}" / "img"
        images.mkdir(parents=True)
        entries = []
        for index in range(4):
            name = f"{index}{FRAME}"
            Image.new("RGB", (64, 64), (60 * index, 90 * number, 9)).save(images / name)
            log = {HOSTILE: {"objectType": HOSTILE, "visible": True}}
            entries.append(
                {"img_idx": index, "img_filename": name, "step": index, "object_log": log}
            )
        (images.parent / "metadata.json").write_text(json.dumps(entries))
    questions = [
        Question(f"t{at % 2}", f"{reply} {at}?", (at % 4,), (reply,), question_type=reply)
        for at, reply in enumerate(REPLIES)
    ]
    write_questions(root / "qa_set_test.csv", questions)
    return root


@pytest.fixture(scope="module")
def hostile_runs(hostile_set: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Runs of two models with hostile names, in which each reply is one of the hostile ones."""
    output = tmp_path_factory.mktemp("runs")
    words = ("--model", "oracle,blind", "--tasks", "nieh_gt", "--data", str(hostile_set))
    with pytest.raises(SystemExit) as ended:
        main([*words, "--out", str(output)])
    assert ended.value.code == 0
    renamed = []
    for number, folder in enumerate(sorted(output.glob("*/nieh*"))):
        header, log = read_run_log(folder, RECORDS)
        name = f"{HOSTILE}{number}"
        model = header.config.model | {"name": name, "checkpoint": HOSTILE}
        config = msgspec.structs.replace(header.config, model=model)
        header = msgspec.structs.replace(header, name=name, config=config)
        given = [
            msgspec.structs.replace(
                record, payload=msgspec.structs.replace(record.payload, reply=REPLIES[at])
            )
            for at, record in enumerate(log.records)
        ]
        renamed.append(output / f"hostile-{number}")
        write_journal(renamed[-1], header, given, RECORDS, log.requests)
    return renamed


def assert_only_text(opened: Opened) -> None:
    tab = opened.tab
    assert tab.evaluate("window.hacked") is None
    assert tab.locator(MARKUP).count() == 0
    assert tab.evaluate("document.scripts.length") <= 4  # three of data, and the page's own
    assert opened.errors == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in opened.requests)
    assert not any(url.endswith("/x") for url in opened.requests)


def test_the_report_of_hostile_runs_shows_text(
    make_page: Callable[..., Any],
    open_page: Callable[..., Opened],
    hostile_runs: list[Path],
    hostile_set: Path,
) -> None:
    page = make_page(*hostile_runs, data=hostile_set)
    opened = open_page(page)
    tab = opened.tab
    assert tab.locator("figure.chart svg text").count() > 0  # names stand in legends of charts
    shown = ""
    for _ in page.samples:
        shown += tab.locator("#sample").inner_text()
        tab.keyboard.press("j")
    for reply in REPLIES[:-1]:
        assert " ".join(reply.split()) in " ".join(shown.split())
    assert HOSTILE.split("\u2028")[0] in tab.locator("#runs").inner_text()
    tab.locator("#sample > .frames button.frame").first.click()
    assert HOSTILE.split("\u2028")[0] in tab.locator("#enlarged").inner_text()
    assert_only_text(opened)


def test_the_page_to_inspect_shows_text_and_saves_decisions(
    browser: Any, hostile_set: Path, tmp_path: Path
) -> None:
    data = NiehSet(hostile_set)
    judged = [
        JudgedQuestion(question, {HOSTILE: reply, "m\ud800": None}, ())
        for question, reply in zip(data.questions, REPLIES, strict=True)
    ]
    path = tmp_path / "inspection.html"
    write_inspection_page(path, judged, data)
    opened = Opened(browser, path)
    images = opened.tab.locator("article img")
    assert images.count() == len(judged)
    images.first.evaluate("it => it.decode()")  # those below are read when they come into view
    assert opened.tab.locator("td", has_text="<svg onload").count() == 1
    opened.tab.locator("input[type=radio]").first.check()
    assert opened.tab.locator("#left").inner_text() == f"{len(judged) - 1} undecided"
    with opened.tab.expect_download() as saved:
        opened.tab.click("#save")
    text = Path(saved.value.path()).read_text(encoding="utf-8")
    assert text.startswith("question_id,decision\n")
    assert len(text.splitlines()) >= len(judged) + 1
    assert_only_text(opened)


@pytest.mark.parametrize(
    ("attempt", "told"),
    [
        ("document.body.append(Object.assign(document.createElement('script'), {text: '1'}))", ""),
        ("document.querySelector('main').innerHTML = '<b>x</b>'", "TrustedHTML"),
        ("document.querySelector('h1').setAttribute('style', 'color: red')", "style"),
        ("document.head.append(Object.assign(document.createElement('style'), "
         "{textContent: '* { display: none }'}))", "style"),
        ("document.body.append(Object.assign(new Image(), {src: 'http://127.0.0.1:9/x.png'}))",
         "img-src"),
        ("fetch('file:///etc/passwd').catch(() => 0)", "connect-src"),
    ],
)  # fmt: skip
def test_the_browser_itself_stops_what_a_faulty_script_would_do(
    make_page: Callable[..., Any],
    open_page: Callable[..., Opened],
    hostile_runs: list[Path],
    hostile_set: Path,
    attempt: str,
    told: str,
) -> None:
    opened = open_page(make_page(*hostile_runs, data=hostile_set))
    done = "async () => { try { await (" + attempt + ") } catch (error) { return String(error) } }"
    refused = opened.tab.evaluate(done) or ""
    opened.tab.wait_for_timeout(100)
    said = " ".join([refused, *opened.errors])
    opened.errors.clear()
    assert "Content Security Policy" in said or "Trusted" in said
    assert told in said or "default-src" in said
    title = opened.tab.locator("h1")
    assert title.is_visible()
    assert title.evaluate("it => getComputedStyle(it).color") != "rgb(255, 0, 0)"
