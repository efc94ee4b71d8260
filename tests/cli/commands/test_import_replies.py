"""Replies that others made: logs in three forms, and what is wrong with them."""

import gzip
import json

import pytest

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import PublishedColumns, Question
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run

from ...helpers.published import PUBLISHED_SETS, make_log_row, needs_published_sets

SINGLE, MULTI = "qa_set_nieh_single_clue", "qa_set_nsieh_multi_clue"
LOG = f"eval_{SINGLE}_Some-VL-7B_full_traj.log"


def question(file, number, text, answer, clues=(1,)):
    return Question(
        f"t{number % 3}",
        text,
        clues,
        (answer,),
        published=PublishedColumns(file, f"q{file}{number}"),
    )


QUESTIONS = (
    question("single", 0, "Where is Mug now?", "SideTable"),
    question("single", 1, "Was Box open?", "Yes"),
    question("single", 2, "Was Box open?", "Yes"),
    question("single", 3, "How many objects were on the Bed?", 3),
)
OTHERS = (question("multi", 4, "Is Mug on the Bed?", "No", (2, 5)),)
REPLIES = ("side table", "yes", "no", "three")


@pytest.fixture
def data(tmp_path):
    """A set of the published form, without frames."""
    folder = tmp_path / "set"
    folder.mkdir()
    write_questions(folder / f"{SINGLE}.csv", QUESTIONS)
    write_questions(folder / f"{MULTI}.csv", OTHERS)
    return folder


def row(number, reply, score, questions=QUESTIONS, **more):
    """A row as the published scripts write it."""
    sizes = {"ctx_size_k": 32, "n_imgs": 6, "ctx_n_tokens": 726, "score": score}
    return make_log_row(number, questions[number], reply, **(sizes | more))


ROWS = [row(number, reply, float(number != 2)) for number, reply in enumerate(REPLIES)]


@pytest.fixture
def import_log(data, tmp_path, run_cli):
    """Imports rows, texts or bytes as logs; returns exit code, what was said, and the records of
    the last run."""

    def import_log(content, name=LOG, *options):
        path = tmp_path / name
        if isinstance(content, list):
            content = "".join(
                one if isinstance(one, str) else json.dumps(one) + "\n" for one in content
            ).encode()
            content = gzip.compress(content, mtime=0) if name.endswith(".gz") else content
        path.write_bytes(content)
        output = tmp_path / "out"
        code, out, err = run_cli("import-replies", path, "--data", data, "--out", output, *options)
        folders = sorted(output.glob("*/*"), key=lambda folder: folder.stat().st_mtime)
        return code, out + err, read_run(folders[-1], RECORDS) if folders else None

    return import_log


def replies_in(read):
    return {record.id: record.payload.reply for record in read[1]}


@pytest.mark.parametrize("name", [LOG, f"{LOG}.gz"])
def test_a_published_log_becomes_a_run(import_log, tmp_path, run_cli, name):
    code, output, read = import_log(ROWS, name)
    assert (code, "4 replies imported, 0 of 4 questions without one" in output) == (0, True)
    header, records = read
    assert (header.name, list(header.config.tasks)) == ("Some-VL-7B", ["nieh_full"])
    assert replies_in(read) == {f"qsingle{number}": reply for number, reply in enumerate(REPLIES)}
    assert [record.payload.scores["reference"] for record in records] == [1.0, 1.0, 0.0, 1.0]
    assert {record.tokens.context for record in records} == {726}
    (folder,) = (tmp_path / "out" / "Some-VL-7B").iterdir()
    assert {"results.json", "scores.jsonl", "usage.json", "journal"} <= {
        path.name for path in folder.iterdir()
    }
    for words in (
        ("show", folder, "--full"),
        ("ls", "runs", tmp_path / "out"),
        ("compare", folder, folder),
    ):
        assert run_cli(*words)[0] == 0
    assert run_cli("report", folder, "--out", tmp_path / "report.html")[0] == 0
    before = (folder / "results.json").read_bytes()
    assert import_log(ROWS, name)[0] == 0
    assert (folder / "results.json").read_bytes() == before
    assert len(list((tmp_path / "out" / "Some-VL-7B").iterdir())) == 1


def test_logs_of_one_mode_on_two_files_are_one_run(data, tmp_path, run_cli):
    single, multi = tmp_path / LOG, tmp_path / f"eval_{MULTI}_Some-VL-7B_full_traj.log"
    single.write_text("\n".join(map(json.dumps, ROWS)))
    multi.write_text(json.dumps(row(0, "no", 1.0, OTHERS)))
    logs = ("import-replies", single, multi, "--data", data, "--out", tmp_path / "out")
    assert run_cli(*logs)[0] == 0
    (folder,) = (tmp_path / "out" / "Some-VL-7B").iterdir()
    summary = json.loads((folder / "results.json").read_text())["summary"]
    by_clues = summary["tasks"]["nieh_full"]["by_clues"]
    assert [by_clues[name]["n"] for name in ("1", "2", ">=3", "total")] == [4, 1, 0, 5]


def test_two_logs_on_the_same_questions_count_them_once(data, tmp_path, run_cli):
    for name, question_id in (("first.jsonl", "qsingle0"), ("second.jsonl", "qmulti4")):
        (tmp_path / name).write_text(json.dumps({"question_id": question_id, "reply": "no"}))
    logs = [tmp_path / "first.jsonl", tmp_path / "second.jsonl"]
    code, _, err = run_cli(
        "import-replies", *logs, "--model", "me", "--data", data, "--out", tmp_path / "out"
    )
    assert (code, "2 replies imported, 3 of 5 questions without one" in err) == (0, True)


def test_half_a_log_is_a_run_with_the_rest_missing(import_log, tmp_path):
    code, output, read = import_log([ROWS[0], json.dumps(ROWS[1])[:60]])
    assert code == 1
    assert "1 replies imported, 3 of 4 questions without one" in output
    assert f"{LOG}, line 2: is not a reply (" in output
    assert len(read[1]) == 1
    (results,) = (tmp_path / "out").glob("*/*/results.json")
    assert json.loads(results.read_text())["n_missing"] == 3


BAD = {
    "another question": (
        {**ROWS[1], "question": "Was Safe open?"},
        "answers another question than row 1",
    ),
    "swapped": ({**ROWS[1], "qidx": 3}, "answers another question than row 3"),
    "another answer": ({**ROWS[1], "gt_answer": ["No"]}, "answers another question than row 1"),
    "beyond the end": ({**ROWS[1], "qidx": 4}, "answers question 4; the file has 4"),
    "before the start": ({**ROWS[1], "qidx": -1}, "is not a reply (Expected `int` >= 0"),
    "the same again": (ROWS[0], "answers qsingle0 again; the first reply is kept"),
    "too long": (
        {**ROWS[1], "llm_response": "yes " * 2_500_000},
        "has a reply of 10,000,000 characters; at most 20,000",
    ),
    "no reply": ({**ROWS[1], "llm_response": None}, "is not a reply (Expected `str`, got `null`"),
    "a list": ("[1, 2]\n", "is not a reply (not a JSON object)"),
    "nested": ("[" * 5000 + "\n", "is not a reply ("),
}


@pytest.mark.parametrize("bad", BAD)
def test_a_row_that_does_not_fit_is_counted_and_named(import_log, bad):
    line, reason = BAD[bad]
    code, output, read = import_log([ROWS[0], line, ROWS[2]])
    assert code == 1
    assert "1 row(s) not imported" in output
    assert f"{LOG}, line 2: {reason}" in output
    assert list(replies_in(read)) == ["qsingle0", "qsingle2"]
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("content", "name", "reason"),
    [
        (
            [{**one, "traj_id": "x"} for one in ROWS],
            LOG,
            "no row answers a question of this set (answers another",
        ),
        ([], LOG, "no row answers a question of this set (it is empty)"),
        (ROWS, "replies.log", "replies.log: its name has no model; give one with --model"),
        (
            [{**ROWS[0], "eval_mode": "dreams"}],
            LOG,
            "the mode 'dreams' is unknown; there are full_traj, truncate_head",
        ),
        (b"\x1f\x8b broken", f"{LOG}.gz", "cannot be read after line 0"),
    ],
)
def test_a_log_that_cannot_be_imported_is_one_line(import_log, content, name, reason):
    code, output, read = import_log(content, name)
    assert (code, read, output.count("\n")) == (2, None, 1)
    assert reason in output


def test_scores_that_differ_from_ours_are_named(import_log):
    code, output, _ = import_log([{**ROWS[0], "score": 0.5}, *ROWS[1:]])
    assert code == 0
    assert "1 row(s) scored otherwise than logged" in output
    assert f"{LOG}, line 1: has the score 0.5; the reference scorer gives 1" in output


def test_replies_in_any_language_are_scored(import_log):
    code, _, read = import_log([{**ROWS[0], "llm_response": "на столе 桌子", "score": 0.0}])
    assert (code, read[1][0].payload.scores) == (0, {"reference": 0.0, "strict": 0.0})


def test_the_neutral_form(import_log):
    counted = {"n_context_tokens": 9, "n_reply_tokens": 2, "seconds": 1.5}
    rows = [
        {"question_id": "qsingle0", "reply": "SideTable", **counted},
        {"question_id": "qmulti4", "reply": "no"},
        {"question_id": "q?", "reply": "no"},
    ]
    code, output, (header, records) = import_log(rows, "mine.jsonl", "--model", "a person")
    assert (code, header.name, list(header.config.tasks)) == (1, "a person", ["imported"])
    assert "2 replies imported, 3 of 5 questions without one" in output
    assert "mine.jsonl, line 3: answers 'q?', which is not in the set" in output
    assert [(record.id, record.payload.scores["strict"]) for record in records] == [
        ("qmulti4", 1.0),
        ("qsingle0", 1.0),
    ]
    assert (records[1].tokens.context, records[1].tokens.reply, records[1].seconds) == (9, 2, 1.5)


@needs_published_sets
def test_every_published_reply_has_its_logged_score(tmp_path, run_cli):
    logs = sorted((PUBLISHED_SETS / "replies").glob("*.log.gz"))
    code, _, err = run_cli("import-replies", *logs, "--data", PUBLISHED_SETS, "--out", tmp_path)
    assert (code, "not imported" in err, "scored otherwise" in err) == (0, False, False)
    assert err.count("the prompt it was asked with: published-logs\n") == 3
    means = {}
    for folder in (tmp_path / "Qwen2.5-VL-7B-Instruct").iterdir():
        ((task, summary),) = json.loads((folder / "results.json").read_text())["summary"][
            "tasks"
        ].items()
        cells = [summary["by_clues"][name] for name in ("1", "total")]
        means[task] = [
            (cell["n"], round(100 * cell["scores"]["reference"]["mean"], 2)) for cell in cells
        ]
    # The first of each is the mean of the single-clue log, as counted by hand.
    assert means == {
        "nieh_published_full": [(829, 55.86), (1303, 51.08)],
        "nieh_published_last_32k": [(829, 56.71), (1303, 54.77)],
        "nieh_published_clip_20": [(829, 54.4), (1303, 50.65)],
    }
