"""The browser of samples: a question side by side, orders, questions that runs disagree on."""

import msgspec
import pytest

from infthor_eval.report.web.samples import Timeline, TimelineFrame

from .conftest import changed


def count(tab):
    return int(tab.locator("#count").inner_text().split()[0])


def test_a_question_is_shown_in_all_contexts_with_frames_and_reasons(page, tab):
    first = page.samples[0]
    same = [sample for sample in page.samples if sample.id == first.id]
    assert len({(sample.task, sample.variant) for sample in same}) > 2
    answers = tab.locator("details.answers .answer")
    assert answers.count() == sum(
        result is not None for sample in same for result in sample.results
    )
    heads = answers.locator("h4").all_inner_texts()
    assert {sample.task for sample in same} <= {head.split()[1].rstrip(",") for head in heads}
    answers.first.locator("details summary").click()
    answers.first.locator("pre", has_text="strict: ").wait_for()
    tab.locator("details.answers > summary").click()
    tab.keyboard.press("j")
    assert tab.locator("details.answers").get_attribute("open") is None  # as it was left


def test_what_a_memory_recalled_is_shown_as_pictures_and_texts(page, open_page):
    sample = page.samples[0]
    shown = sample.timeline.frames[0]
    further = TimelineFrame(40, shown.picture)
    timeline = msgspec.structs.replace(sample.timeline, recalled=(further,))
    results = (
        msgspec.structs.replace(sample.results[0], recalled=(shown.index, 40, "a red mug")),
        *sample.results[1:],
    )
    recalled = msgspec.structs.replace(sample, timeline=timeline, results=results)
    answer = open_page(changed(page, samples=[recalled])).tab.locator(".answer").first
    assert answer.locator("img").count() == 2
    assert answer.locator("figcaption").all_inner_texts()[1] == "40"
    assert "2 frames recalled" in answer.inner_text()
    assert answer.locator("pre.recalled").inner_text() == "a red mug"


def test_renumbering_facts_reaches_recalled_frames():
    timeline = Timeline(9, (TimelineFrame(1, facts=0),), "", (TimelineFrame(2, facts=1),))
    numbers = timeline.renumbered([5, 7])
    assert (numbers.frames[0].facts, numbers.recalled[0].facts) == (5, 7)


def test_questions_that_two_runs_disagree_on(page, tab):
    tab.select_option("#run", index=1)
    tab.select_option("#against", index=2)
    differ = [sample for sample in page.samples if len({it.outcome for it in sample.results}) > 1]
    assert count(tab) == len(differ) > 0


def test_runs_of_different_contexts_disagree_by_question(page, open_page):
    first = page.samples[0]
    other = next(sample for sample in page.samples if sample.id != first.id)
    right, wrong = (
        msgspec.structs.replace(first.results[0], outcome=it) for it in ("right", "wrong")
    )
    samples = [
        msgspec.structs.replace(first, task="a", results=(right, None)),
        msgspec.structs.replace(first, task="b", results=(None, wrong)),
        msgspec.structs.replace(other, task="a", results=(right, None)),
        msgspec.structs.replace(other, task="b", results=(None, right)),
    ]
    tab = open_page(changed(page, samples=samples)).tab
    tab.select_option("#against", index=2)
    assert count(tab) == 2
    tab.select_option("#run", index=1)
    assert count(tab) == 1


def test_the_list_is_sorted_by_a_column_either_way(page, tab):
    tab.select_option("#sort", "question")
    titles = sorted(sample.title for sample in page.samples)
    assert tab.locator(".item .q").first.inner_text() == titles[0]
    tab.check("#descending")
    assert tab.locator(".item .q").first.inner_text() == titles[-1]
    tab.select_option("#sort", "seconds")
    slowest = max(result.seconds for sample in page.samples for result in sample.results)
    times = tab.locator("#sample .results td[data-name=seconds]").all_inner_texts()
    assert max(map(float, times)) == pytest.approx(slowest, abs=0.005)
    tab.keyboard.press("Escape")


def test_the_table_of_runs_is_sorted_and_its_chart_is_saved(tab, tmp_path):
    heading = tab.locator("#results th", has_text="%").first
    heading.locator("button").click()
    assert heading.get_attribute("aria-sort") == "descending"
    scores = tab.locator("#results td:nth-child(4)").all_inner_texts()
    assert scores == sorted(scores, key=float, reverse=True)
    heading.locator("button").click()
    assert tab.locator("#results td:nth-child(4)").all_inner_texts() == scores[::-1]
    saved = {}
    for kind in ("svg", "csv"):
        with tab.expect_download() as download:
            tab.locator(f"#results figure .save[data-kind={kind}]").click()
        saved[kind] = tmp_path / download.value.suggested_filename
        download.value.save_as(saved[kind])
    assert saved["svg"].name == "Results.svg"
    assert "currentColor" not in saved["svg"].read_text()
    assert saved["csv"].read_text().startswith("run,")
