import csv
import json
from functools import partial

import pytest

from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.baselines import BASELINES
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.storage.folders import packaged_folder

from ....helpers.baselines import ScriptedBaseline
from ....helpers.command_line import assert_refused, option_words, read_success
from ....helpers.questions import make_question

# Of known skill: which answers each scripted model gets right.
SKILLS = {
    "one-clue": lambda q: len(q.clues) == 1,
    "yes": lambda q: q.answers == ("yes",),
    "counter": lambda q: str(q.answers[0]).isdecimal(),
    "places": lambda q: q.question_type in {"location_tracing", "put_action"} and len(q.clues) < 3,
    "none": lambda q: False,
    "half": lambda q: len(q.answers) == 2,
}
QUESTIONS = [
    make_question(),
    Question("t", "What is <b>it</b>?", (2,), ("mug",)),
    Question("t", "Was it there?", (1, 2), ("yes",)),
    Question("t", "Where was it?", (1, 3), ("shelf",)),
    Question("t", "Which two?", (1, 2, 4), ("mug", "plate")),
]


def reply_of(name, question):
    """The reply of a model of that skill."""
    if name == "half" and SKILLS["half"](question):
        return str(question.answers[0])
    return ", ".join(question.answers) if SKILLS[name](question) else "<script>wrong</script>"


@pytest.fixture
def data(make_nieh_set, monkeypatch):
    scripted = {
        name: lambda _, name=name: ScriptedBaseline(name, partial(reply_of, name))
        for name in SKILLS
    }
    monkeypatch.setattr(NiehSuite, "baselines", {**BASELINES, **scripted})
    return make_nieh_set(QUESTIONS, size=56)


def kept(folder):
    return [question.text for question in read_questions(folder / "qa_set_validated.csv")]


def test_questions_that_one_model_answers_are_kept_and_the_rest_is_rejected_or_inspected(
    data, tmp_path, run_cli
):
    out = tmp_path / "validated"
    printed, _ = read_success(run_cli("validate", data, "--model", "yes,none", "--out", out))
    assert kept(out) == ["Is there a mug?", "Was it there?"]
    rejected = [json.loads(line) for line in (out / "rejected.jsonl").read_text().splitlines()]
    assert [item["question"] for item in rejected] == ["What is <b>it</b>?"]
    assert set(rejected[0]["replies"]) == {"yes", "none"}
    with (out / "inspection.csv").open(newline="") as file:
        inspected = list(csv.DictReader(file))
    assert [row["question"] for row in inspected] == ["Where was it?", "Which two?"]
    assert "5 questions: 2 kept, 1 rejected, 2 to inspect" in printed
    assert next(line for line in printed.splitlines() if line.startswith("  yes")).split()[3:9] == [
        *("100.00", "(1)", "100.00", "(1)", "-", "100.00")
    ]
    words = option_words(model="oracle", tasks="nieh_gt", data=out, out=tmp_path / "o")
    assert run_cli(*words)[0] == 0


def test_the_bundled_set_keeps_exactly_what_a_model_of_four_can_answer(data, tmp_path, run_cli):
    bundled, out, models = (
        packaged_folder("sets/nieh_mini"),
        tmp_path / "validated",
        ("yes", "counter", "places", "none"),
    )
    printed, _ = read_success(
        run_cli("validate", bundled, "--model", ",".join(models), "--out", out)
    )
    questions = [
        item for path in sorted(bundled.glob("qa_set*.csv")) for item in read_questions(path)
    ]
    known = [item for item in questions if any(SKILLS[name](item) for name in models)]
    unknown = [item for item in questions if item not in known]
    alone = {
        name: [q for q in known if [m for m in models if SKILLS[m](q)] == [name]] for name in models
    }
    assert len(known) > 50 and len(unknown) > 20 and all(alone[name] for name in models[:3])
    assert read_questions(out / "qa_set_validated.csv") == known
    rejected = {
        json.loads(line)["question_id"]
        for line in (out / "rejected.jsonl").read_text().splitlines()
    }
    assert rejected == {item.id for item in unknown if len(item.clues) == 1}
    with (out / "inspection.csv").open(newline="") as file:
        assert {row["question_id"] for row in csv.DictReader(file)} == {
            q.id for q in unknown if len(q.clues) > 1
        }
    assert f"{len(questions)} questions: {len(known)} kept" in printed


def test_the_page_shows_frames_and_lets_no_markup_through(data, tmp_path, run_cli):
    out = tmp_path / "validated"
    run_cli("validate", data, "--model", "none", "--out", out)
    page = (out / "inspection.html").read_text()
    assert "<script>wrong" not in page
    assert "&lt;script&gt;wrong" in page
    assert page.count("<img") == 2 + 2 + 3
    source = page.split('<img src="')[1].split('"')[0]
    assert (out / source).resolve().is_file()


def test_decisions_are_applied(data, tmp_path, run_cli):
    out = tmp_path / "validated"
    arguments = ["validate", data, "--model", "one-clue,none", "--out", out]
    run_cli(*arguments)
    rows = list(csv.DictReader((out / "inspection.csv").open(newline="")))
    decisions = tmp_path / "decisions.csv"
    choices = zip(rows, ("keep", "drop", ""), strict=True)
    decisions.write_text(
        "question_id,decision\n" + "".join(f"{row['question_id']},{c}\n" for row, c in choices)
    )
    printed, err = read_success(run_cli(*arguments, "--decisions", decisions))
    assert kept(out) == ["Is there a mug?", "What is <b>it</b>?", "Was it there?"]
    assert "3 kept, 1 rejected, 1 to inspect" in printed
    assert "0 evaluated now, 5 resumed" in err


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("question_id,decision\nx,keep\n", "about x, which is not in the set"),
        ("question_id,decision\nx,maybe\n", "line 2: decision is 'maybe'; write keep or drop"),
        ("question_id\nx\n", "no column decision"),
    ],
)
def test_decisions_that_do_not_fit_are_refused(data, tmp_path, run_cli, content, expected):
    decisions = tmp_path / "decisions.csv"
    decisions.write_text(content)
    ended = run_cli(
        "validate", data, "--model", "none", "--out", tmp_path / "v", "--decisions", decisions
    )
    assert_refused(ended, expected, after_notes=True)
    assert not (tmp_path / "v" / "qa_set_validated.csv").exists()


def test_the_published_filter_keeps_what_is_answered_in_part(data, tmp_path, run_cli):
    words = ("validate", str(data), "--model", "half", "--out")
    code, out, _ = run_cli(*words, str(tmp_path / "strict"))
    assert (code, "0 kept" in out) == (0, True)
    code, out, _ = run_cli(*words, str(tmp_path / "published"), "--published")
    assert (code, "1 kept" in out) == (0, True)
    assert kept(tmp_path / "published") == ["Which two?"]
    ended = run_cli(*words, str(tmp_path / "both"), "--published", "--scorer", "strict")
    assert_refused(ended, "--scorer strict", after_notes=True)
