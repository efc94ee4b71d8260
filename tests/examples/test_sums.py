"""The example suite of another package runs, is resumed, compared and reported once pip has
installed it."""

import json
import re

import pytest

from infthor_eval.cli import main
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.run import open_runs

from ..helpers.command_line import option_words

MODELS = ("calculator", "qwen2.5-vl-tiny")


@pytest.fixture(scope="module")
def folders(install, tmp_path_factory):
    """Folders of a run of the baseline and of a model; the package can be imported as long as the
    module is tested."""
    output = tmp_path_factory.mktemp("sums")
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(install("sums"))
        with pytest.raises(SystemExit) as ended:
            main(
                option_words(model=",".join(MODELS), tasks="sums_small", limit="8", out=str(output))
            )
        assert ended.value.code == 0
        yield [next((output / model).iterdir()) for model in MODELS]


@pytest.fixture(scope="module")
def page(folders):
    return build_page(open_runs(folders), PageRequest())


def test_its_results_are_shown_and_exported(folders, run_cli):
    code, out, _ = run_cli("show", *folders)
    rows = {
        line.split()[0]: line.split()
        for line in out.splitlines()
        if "sums_small" in line and "/" not in line
    }
    assert code == 0
    assert rows["calculator"][2] == "100.0"
    assert rows["qwen2.5-vl-tiny"][-1] == "8"
    (samples,) = folders[0].rglob("samples_sums_small_*.jsonl")
    lines = [json.loads(line) for line in samples.read_text().splitlines()]
    assert all(
        line["target"] == str(sum(map(int, line["doc"]["id"].split("+")))) == line["resps"][0][0]
        for line in lines
    )
    assert "sums_small right % 100.00 0.00 -100.00" in " ".join(
        run_cli("compare", *folders)[1].split()
    )


def test_a_stopped_run_goes_on(folders, run_cli):
    (journal,) = (folders[0] / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:-3]) + "\n")
    words = option_words(model="calculator", tasks="sums_small", limit=8, out=folders[0].parents[1])
    code, _, err = run_cli(*words)
    assert (code, "3 evaluated now, 5 resumed from the journal" in err) == (0, True)


def test_its_page_has_its_tables_its_chart_and_its_samples(page):
    sections = {section.key: section for section in page.sections}
    assert sections["sums"].title == "Sums"
    (chart,) = sections["sums"].charts
    assert (chart.title, chart.description[:18]) == (
        "sums_small: right by kind",
        "all (8) calculator",
    )
    (table,) = sections["sums"].tables
    assert [column.name for column in table.columns] == [
        "model",
        "task",
        "all",
        "with carry",
        "without carry",
        "questions",
    ]
    assert {row.cells[2] for row in sections["results"].tables[0].rows} == {"right"}
    assert len(page.samples) == 8
    for sample in page.samples:
        a, b = map(int, re.findall(r"\d+", sample.title))
        right, wrong = sample.results
        assert (sample.target, right.reply, right.outcome, wrong.outcome) == (
            str(a + b),
            str(a + b),
            "right",
            "wrong",
        )
        assert sample.kind in ("with carry", "without carry")
        assert wrong.tokens[0] > 0


def test_its_page_opens_in_a_browser(page, open_page):
    opened = open_page(page)
    tab = opened.tab
    tab.select_option("#kind", "with carry")
    carried = [sample for sample in page.samples if sample.kind == "with carry"]
    assert tab.locator("#count").inner_text() == f"{len(carried)} of 8"
    assert tab.locator("#sample h3").inner_text() == carried[0].title
    assert tab.locator("#sample .target").inner_text() == f"gold answer: {carried[0].target}"
    assert tab.locator("#sums figure.chart svg").count() == 1
    assert tab.locator("#disagree").is_hidden()  # it has one scorer
    assert opened.errors == []
