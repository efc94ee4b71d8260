"""Suites of questions: a dataset, a scorer, and nothing else, run and read as every suite is."""

import json
import sys
import zipfile

import pytest
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.questions import Question, QuestionSuite
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import open_runs
from infthor_eval.runs import read_run
from infthor_eval.suites import find_presenter, find_suite
from tests.helpers.command_line import option_words

SUITE = """
from pathlib import Path
from infthor_eval.questions import Question, QuestionSuite

FOLDER = Path(__file__).parent

def colours(n: int, broken: str = ""):
    for number in range(n):
        picture = FOLDER / ("missing.png" if broken == f"q{number}" else f"{number % 2}.png")
        yield Question(
            id=f"q{number}",
            text=f"Is the picture white ({number})?",
            answer=["no", "yes"][number % 2],
            kind=["black", "white"][number % 2],
            cluster=f"pair {number // 2}",
            pictures=(picture,),
        )

def exact(reply, question):
    return {"no": 0, "yes": 1, "maybe": 7}[reply] == ["no", "yes"].index(question.answer) or (
        7 if reply == "maybe" else 0
    )

def told(question):
    return question.answer

def clumsy(question):
    return {"q0": "what?", "q1": "maybe", "q2": 5, "q3": question.answer}[question.id]

SUITE = QuestionSuite("colours", colours, exact, {"told": told, "clumsy": clumsy})
"""
MODEL = """
import numpy as np

def answer(images, text):
    return "yes" if len(images) == 1 and np.asarray(images[-1]).mean() > 100 else "no"
"""
TASK = """
task: {name}
metadata: {{suite: colours, version: 1}}
dataset_kwargs: {kwargs}
generation_kwargs: {{max_gen_toks: 8}}
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with a suite of questions about pictures, as pip would leave it; its folder."""
    (tmp_path / "colours.py").write_text(SUITE)
    (tmp_path / "seeing.py").write_text(MODEL)
    for number in (0, 1):
        Image.new("RGB", (40, 40), (255 * number,) * 3).save(tmp_path / f"{number}.png")
    (tmp_path / "tasks").mkdir()
    write_task(tmp_path, "colours", "{n: 6}")
    info = tmp_path / "Colours-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: Colours\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[infthor_eval.suites]\ncolours = colours:SUITE\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    yield tmp_path
    sys.modules.pop("colours", None)


def write_task(folder, name, kwargs):
    (folder / "tasks" / f"{name}.yaml").write_text(TASK.format(name=name, kwargs=kwargs))


@pytest.fixture
def run(package, run_cli):
    """Runs the suite; gives the exit code, standard error and the run's folder."""

    def run(model="told", task="colours", out="out", **options):
        words = option_words(model=model, tasks=task, out=package / out, **options)
        code, _, err = run_cli(*words, "--include-path", package / "tasks")
        folders = sorted((package / out).glob(f"*/{task}-*"), key=lambda it: it.stat().st_mtime)
        return code, err, folders[-1] if folders else None

    return run


def records_of(folder):
    return {record.id: record for record in read_run(folder, find_suite("colours").records)[1]}


def test_a_model_sees_the_pictures_and_its_replies_are_scored(package, run):
    code, _, folder = run(f"{package}/seeing.py:answer")
    records = records_of(folder)
    assert code == 0
    assert {it.payload.reply for it in records.values()} == {"yes", "no"}
    results = json.loads((folder / "results.json").read_text())
    assert results["summary"]["metric"] == "exact"
    assert results["summary"]["tasks"]["colours"].keys() == {"all", "black", "white"}
    assert results["primary_metrics"]["colours"]["mean"] == 1.0
    assert records["q1"].cluster == records["q0"].cluster == "pair 0"


def test_a_stopped_run_goes_on(run):
    _, _, folder = run()
    (journal,) = (folder / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:-2]) + "\n")
    code, err, _ = run()
    assert (code, "2 evaluated now, 4 resumed from the journal" in err) == (0, True)


def test_workers_give_the_same_records(run):
    alone = records_of(run()[2])
    code, err, folder = run(workers=2, out="shared")
    assert code == 0, err
    shared = records_of(folder)
    assert {key: it.payload for key, it in alone.items()} == {
        key: it.payload for key, it in shared.items()
    }


def test_its_page_has_a_chart_by_kind_and_each_question_with_its_picture(run):
    folder = run()[2]
    page = build_page(open_runs([folder]), PageRequest())
    (section,) = [section for section in page.sections if section.key == "colours"]
    (chart,) = section.charts
    assert chart.title == "colours: exact by kind"
    assert "all (6) 100.0; black (3) 100.0; white (3) 100.0" in chart.description
    assert len(page.samples) == 6
    sample = page.samples[0]
    assert (sample.title, sample.target, sample.kind) == (
        "Is the picture white (0)?",
        "no",
        "black",
    )
    assert (sample.results[0].reply, sample.results[0].outcome) == ("no", "right")
    assert sample.timeline.frames[0].picture is not None


def test_inspect_s_log_has_request_picture_reply_and_score(package, run, run_cli):
    folder = run()[2]
    words = ("--format", "inspect", "--frames", "--out", package / "log")
    assert run_cli("export", folder, *words)[0] == 0
    (log,) = (package / "log").glob("*.eval")
    with zipfile.ZipFile(log) as archive:
        samples = [
            json.loads(archive.read(name))
            for name in archive.namelist()
            if name.startswith("samples/")
        ]
    (sample,) = [it for it in samples if it["id"] == "q1"]
    image, text = sample["input"][0]["content"]
    assert (image["type"], text["text"]) == ("image", "Is the picture white (1)?")
    assert len(sample["attachments"]) == 1
    assert (sample["target"], sample["scores"]["exact"]["value"]) == ("yes", 1.0)
    assert sample["messages"][-1]["content"] == "yes"


def test_a_dataset_that_changed_gives_no_pictures_and_says_so(package, run):
    folder = run()[2]
    (package / "colours.py").write_text(SUITE.replace("Is the picture", "Was the picture"))
    sys.modules.pop("colours")
    (run_of_page,) = open_runs([folder])
    assert build_page([run_of_page], PageRequest()).samples[0].title == "Is the picture white (0)?"
    notes = run_of_page.presenter.timelines([run_of_page], None, ThumbnailStore(10**6)).notes
    assert notes == [
        "colours: no pictures are shown: the dataset has changed since the run; run it again"
    ]


def test_a_dataset_that_fails_today_is_told_beside_the_run_s_page(package, run):
    folder = run()[2]
    # of another length, so that no bytecode of before is taken for it
    (package / "colours.py").write_text(SUITE.replace("n: int", "other: int"))
    sys.modules.pop("colours")
    (run_of_page,) = open_runs([folder])
    (note,) = run_of_page.presenter.timelines([run_of_page], None, ThumbnailStore(10**6)).notes
    assert "colours: no pictures are shown: dataset_kwargs: Object " in note


def test_what_fails_on_a_question_costs_that_question_alone(package, run):
    write_task(package, "colours_hard", "{n: 4, broken: q3}")
    code, _, folder = run("clumsy", "colours_hard")
    records = records_of(folder)
    assert code == 1
    failures = {key: record.failure for key, record in records.items()}
    assert "exact fails on q0: KeyError in colours.py" in failures["q0"]
    assert records["q0"].payload.reply == "what?"
    assert "it gives 7; a score is from 0 to 1" in failures["q1"]
    assert "clumsy fails on q2 (TypeError" in failures["q2"]
    assert "it gives 5, which is no text" in failures["q2"]
    assert "missing.png" in failures["q3"]
    write_task(package, "colours_hard", "{n: 4, broken: q2}")
    assert run("told", "colours_hard")[0] == 1
    assert {
        key for key, it in records_of(run("told", "colours_hard")[2]).items() if it.failure
    } == {"q2"}


@pytest.mark.parametrize(
    ("kwargs", "expected"),
    [
        ("{}", "Object missing required field `n`; the settings are n, broken"),
        ("{n: many}", "Expected `int`, got `str` - at `$.n`"),
        ("{n: 3, m: 4}", "Object contains unknown field `m`"),
        ("[1]", "Expected `object`, got `array`"),
        ("{n: 0}", "the dataset of colours has no questions; give at least one"),
    ],
)
def test_a_setting_that_does_not_fit_is_refused_in_one_line(package, run, kwargs, expected):
    write_task(package, "colours", kwargs)
    code, err, _ = run()
    assert (code, err.count("\n")) == (2, 1)
    assert f"{package / 'tasks' / 'colours.yaml'}: " in err
    assert expected in err


def gives(*questions):
    """A suite whose dataset gives these, or raises the only one."""

    def dataset():
        if isinstance(questions[0], Exception):
            raise questions[0]
        return list(questions)

    suite = QuestionSuite("made", find_suite, find_presenter)
    suite._dataset = dataset
    return suite


@pytest.mark.parametrize(
    ("questions", "expected"),
    [
        (["q"], "gives 'q'; it gives Questions"),
        ([Question("q", "?", 5)], "gives 5 as answer of 'q'; it is a text"),
        ([Question("", "?", "5")], "gives '' as id of ''; it is a text"),
        (
            [Question("q", "?", "5"), Question("q", "!", "6")],
            "has 2 questions 'q'; give each an id",
        ),
        ([Question("q", "?", "5", pictures=("a.png",))], "as pictures of q; they are Paths"),
        ([Question("q", "?", "5", kind="all")], "calls the kind of q all"),
        ([Question("q", "\ud800", "5")], "the dataset of made fails (UnicodeEncodeError"),
        ([OSError("no file")], "the dataset of made fails (OSError"),
    ],
)
def test_what_is_no_dataset_is_refused_in_one_line(questions, expected):
    with pytest.raises(Exception, match="the dataset of made") as caught:
        gives(*questions).questions({})
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_functions_that_workers_cannot_find_are_refused():
    with pytest.raises(UsageError, match="write its functions at the top of a module"):
        QuestionSuite("made", find_suite, lambda reply, question: 1.0)
