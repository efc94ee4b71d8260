"""What was sent, and what failed: prompts, clues that a context left out, tracebacks, `blind`."""

import json
import shutil

import msgspec

from infthor_eval.runs import UnitKey
from infthor_eval.runs.journals.shards import find_shards
from infthor_eval.runs.journals.tracebacks import TracebackFile
from infthor_eval.storage.folders import packaged_folder

from .conftest import HOSTILE, changed

DATA = packaged_folder("sets/nieh_mini")


def test_equal_prompts_are_there_once_and_none_is_guessed(page):
    used = {result.prompt for sample in page.samples for result in sample.results}
    assert used == set(range(len(page.prompts)))
    assert not any(prompt.problem for prompt in page.prompts)
    for sample in page.samples:
        # Both runs were asked the same.
        assert len({result.prompt for result in sample.results}) == 1


def test_the_prompt_is_known_without_the_set(make_page, nieh_runs, make_nieh_set, open_page):
    page = make_page(nieh_runs[0], data=make_nieh_set())
    tab = open_page(page).tab
    tab.select_option("#task", "nieh_haystack_8k")
    tab.click("details.prompt summary")
    assert "Question: " in tab.locator("details.prompt pre").inner_text()


def test_a_run_without_requests_says_that_they_are_not_known(
    make_page, nieh_runs, open_page, tmp_path
):
    """As runs of earlier versions are."""
    run = tmp_path / "run"
    shutil.copytree(nieh_runs[0], run)
    for shard in find_shards(run):
        lines = map(json.loads, shard.read_text().splitlines())
        kept = [line for line in lines if line["type"] != "artifact"]
        for line in kept:
            line.pop("request", None)
            line.get("config", {}).get("model", {}).pop("baseline", None)
        shard.write_text("".join(f"{json.dumps(line)}\n" for line in kept))
    tab = open_page(make_page(run, data=DATA)).tab
    tab.click("details.prompt summary")
    assert "It is not known: the run's journal has none" in tab.inner_text("details.prompt")
    assert tab.locator("details.prompt pre").count() == 0


def test_the_whole_prompt_unfolds_with_its_frames_in_their_places(page, tab):
    tab.select_option("#task", "nieh_mini_gt")
    sample = next(it for it in page.samples if it.task == "nieh_mini_gt")
    tab.locator("details.prompt summary").click()
    text = tab.locator("details.prompt").inner_text()
    clues = [frame.index for frame in sample.timeline.frames if frame.is_clue]
    assert f"⟦{len(clues)} × frames: " in text
    assert f"Question: {sample.title}" in text
    assert "a baseline is not sent it" in text


def test_clues_that_a_context_left_out_are_marked(page, open_page):
    # A window that ends before the clue of the sample.
    sample = next(
        it for it in page.samples if sum(frame.is_clue for frame in it.timeline.frames) == 1
    )
    (clue,) = (frame for frame in sample.timeline.frames if frame.is_clue)
    number = len(page.prompts)
    cut = msgspec.structs.replace(page.prompts[0], shown=((clue.index + 1, clue.index + 9),))
    first, second = sample.results
    for results, caption in (
        ((first, msgspec.structs.replace(second, prompt=number)), "clue, not shown to all"),
        (
            tuple(msgspec.structs.replace(it, prompt=number) for it in sample.results),
            "clue, not shown",
        ),
    ):
        results_changed = msgspec.structs.replace(sample, results=results)
        opened = open_page(changed(page, samples=[results_changed], prompts=[*page.prompts, cut]))
        assert (
            opened.tab.locator("#sample > .frames .clue figcaption").inner_text()
            == f"{clue.index} {caption}"
        )
        opened.tab.locator("#sample > .frames .clue button").click()
        without = opened.tab.locator("#enlarged dd").last.inner_text()
        labels = [run.label for run in page.runs]
        assert without == (", ".join(labels) if caption.endswith("shown") else labels[1])


def test_evidence_and_blind_stand_beside_the_reply(page, open_page):
    sample = next(
        it
        for it in page.samples
        if "blind" in it.results[0].details and "clue frames shown" in it.results[0].details
    )
    tab = open_page(changed(page, samples=[sample])).tab
    text = tab.locator("#sample .details").first.inner_text()
    assert "clue frames shown" in text
    assert "strict" in sample.results[0].details["blind"]
    assert sample.results[0].details["blind"] in text


def test_tracebacks_of_failures_unfold_as_text(make_page, nieh_runs, tmp_path, open_page):
    copy = tmp_path / "failed"
    shutil.copytree(nieh_runs[0], copy)
    (journal,) = (copy / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines()
    records = [json.loads(line) for line in lines]
    at = [place for place, record in enumerate(records) if record["type"] == "unit"][:2]
    file = TracebackFile(copy / "journal")
    error = ZeroDivisionError(HOSTILE)
    for place in at:
        record = records[place]
        file.append(UnitKey(record["task"], record["id"], record.get("variant", "")), 1, error)
        record["failure"] = "ZeroDivisionError; traceback in journal/tracebacks.txt"
        record["payload"].pop("reply", None)
        record["payload"].pop("scores", None)
    journal.write_text("\n".join(map(json.dumps, records)) + "\n")
    page = make_page(copy, data=DATA)
    tab = open_page(page).tab
    (text,) = page.tracebacks  # of both: the second one's says that it is as for the first
    assert text.endswith(f"ZeroDivisionError: {HOSTILE}")
    tab.select_option("#outcome", "failed")
    for _ in at:
        tab.click("details.traceback summary")
        assert (
            "ZeroDivisionError: </script><img" in tab.locator("details.traceback pre").inner_text()
        )
        tab.keyboard.press("j")
    assert tab.evaluate("window.hacked") is None
