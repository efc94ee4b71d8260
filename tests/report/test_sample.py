"""A sample of a run: in words, and as the cell of a notebook."""

import re
from pathlib import Path

import msgspec
import pytest
from PIL import Image

import infthor_eval
from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.records import RECORDS
from infthor_eval.report.descriptions import StepRow
from infthor_eval.report.sample import Sample, TokenCounts
from infthor_eval.runs import Tokens, Usage
from tests.helpers.command_line import option_words, read_success
from tests.helpers.journals import write_journal
from tests.helpers.nieh_runs import make_config, make_header, make_record

HOSTILE = "<script>alert(1)</script>"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run of two questions, one of which failed, on a set that is not there."""
    config = make_config(model="m", checkpoint=None, n_parameters=None)
    records = (
        make_record(0, HOSTILE, ("Bed",)),
        make_record(1, None, ("Bed",), failure="the server is away"),
    )
    return write_journal(tmp_path / "run", make_header(config, "m"), records, RECORDS)


def names_of(folder: Path) -> list[str]:
    frame = infthor_eval.load_run(folder)
    return list(frame.sort_values("state")["id"])  # the answered one first


def test_texts_of_a_reply_are_no_markup(folder: Path) -> None:
    answered, _ = names_of(folder)
    page = infthor_eval.load_sample(folder, answered)._repr_html_()
    assert HOSTILE not in page
    assert "&lt;script&gt;" in page
    assert "no frames:" in page  # and why, as the set is not there
    assert "not known: the run&#39;s journal has none" in page


def test_a_failed_sample_has_its_reason_and_no_score(folder: Path) -> None:
    _, failed = names_of(folder)
    sample = infthor_eval.load_sample(folder, failed)
    assert sample.scores == {}
    assert "failed, in no score: the server is away" in repr(sample)
    page = sample._repr_html_()
    assert "the server is away" in page
    assert "(empty)" not in page


def test_a_name_that_no_sample_has_is_refused(folder: Path) -> None:
    with pytest.raises(UsageError, match="unknown question"):
        infthor_eval.load_sample(folder, "nothing")


def test_printed_it_is_what_the_command_prints(folder: Path, run_cli) -> None:
    answered, _ = names_of(folder)
    out, _ = read_success(run_cli("show", folder, "--question", answered))
    assert out.rstrip("\n") == repr(infthor_eval.load_sample(folder, answered))


def test_an_episode_has_its_steps(tmp_path: Path, run_cli) -> None:
    words = option_words(model="still", tasks="manipulathor_mini", limit=1, out=tmp_path)
    assert run_cli(*words)[0] == 0
    (folder,) = (tmp_path / "still").iterdir()
    name = infthor_eval.load_run(folder)["id"][0]
    sample = infthor_eval.load_sample(folder, name)
    assert f"{len(sample.steps)} steps" in sample._repr_html_()
    listed = [line for line in sample.lines() if re.match(r" +\d+\. ", line)]
    assert len(listed) == len(sample.steps) > 0
    assert all(step.action in line for step, line in zip(sample.steps, listed, strict=True))
    numbers = [int(line.partition(".")[0]) for line in listed]
    assert numbers == list(range(1, len(listed) + 1))
    assert sample.request is None


@pytest.mark.parametrize(
    ("step", "text"),
    [
        (StepRow("MoveAhead"), "MoveAhead"),
        (StepRow("MoveAhead", reward=0.5), "MoveAhead, reward 0.5"),
        (StepRow(reward=0.0, error="no action"), "(no action), reward 0: no action"),
    ],
)
def test_a_step_is_told_with_its_reward_and_what_was_wrong(
    folder: Path, monkeypatch: pytest.MonkeyPatch, step: StepRow, text: str
) -> None:
    monkeypatch.setattr(Sample, "steps", (step,))
    sample = infthor_eval.load_sample(folder, names_of(folder)[0])
    assert f"     1. {text}" in list(sample.lines())


@pytest.mark.parametrize(("count", "note"), [(24, ""), (25, "24 of 25 frames, evenly")])
def test_a_cell_says_how_many_frames_it_leaves_out(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, count: int, note: str
) -> None:
    for number in range(count):
        Image.new("RGB", (8, 8), (number, 0, 0)).save(tmp_path / f"{number}.png")
    frames = [FrameRef(tmp_path / f"{number}.png") for number in range(count)]
    monkeypatch.setattr(Sample, "frames", frames)
    page = infthor_eval.load_sample(folder, names_of(folder)[0])._repr_html_()
    assert page.count("data:image/webp") == min(count, 24)
    assert ("frames, evenly" in page) == bool(note)
    assert note in page


@pytest.mark.parametrize(
    ("tokens", "usage", "counted"),
    [
        (Tokens(context=9, cached=4, reply=2), Usage(), (9, 4, 2)),
        (Tokens(), Usage(requests=1, context=9), (9, 0, 0)),
        (Tokens(), Usage(requests=1, reply=2), (0, 0, 2)),
        (Tokens(context=9), Usage(), None),
    ],
)
def test_tokens_are_those_of_the_reply_else_of_all_requests(
    folder: Path, tokens: Tokens, usage: Usage, counted: tuple[int, int, int] | None
) -> None:
    sample = infthor_eval.load_sample(folder, names_of(folder)[0])
    record = msgspec.structs.replace(sample.record, tokens=tokens, usage=usage)
    found = Sample(sample.run, record).tokens
    assert found == (counted and TokenCounts(*counted))
