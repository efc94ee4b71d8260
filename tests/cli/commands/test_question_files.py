"""Question files without frames: what runs on them, and what says that it cannot."""

import json
import shutil

import pytest

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import PublishedColumns, Question

from ...helpers.command_line import assert_refused, option_words
from ...helpers.published import PUBLISHED_SETS, needs_published_sets

FILES = ("qa_set_nieh_single_clue.csv", "qa_set_nsieh_multi_clue.csv")


@pytest.fixture
def alone(make_nieh_set):
    """A set whose frames are gone."""
    root = make_nieh_set(size=56)
    shutil.rmtree(root / "metadata")
    return root


def by_clues_of(folder):
    summary = json.loads((folder / "results.json").read_text())["summary"]
    return summary["tasks"]["nieh_gt"]["by_clues"]


def test_baselines_run_on_them(alone, run_cli, evaluate):
    folders = [evaluate(model, data=alone) for model in ("oracle", "blind", "random")]
    by_clues = by_clues_of(folders[0])
    assert [by_clues[name]["n"] for name in ("1", "2", ">=3", "total")] == [3, 1, 1, 5]
    assert run_cli("show", *folders[:2])[0] == 0


@pytest.mark.parametrize(
    ("model", "task", "expected"),
    [
        ("qwen2.5-vl-tiny", "nieh_gt", "has questions but no frames, which qwen2.5-vl-tiny needs"),
        ("blind", "nieh_full", "has no metadata/ with frames; unpack the set's metadata.tar there"),
    ],
)
def test_what_shows_frames_says_that_there_are_none(
    alone, tmp_path, run_cli, model, task, expected
):
    words = option_words(model=model, tasks=task, data=alone, out=tmp_path / "out")
    assert_refused(run_cli(*words), expected, after_notes=True)


def test_further_forms_are_refused_in_the_published_words(make_nieh_set, tmp_path, run_cli):
    words = (
        "questions",
        make_nieh_set(size=56),
        *option_words(out=tmp_path / "a.csv", words="published"),
        "--further",
    )
    assert_refused(
        run_cli(*words),
        "--further adds forms that have no published words; leave it out, or --words published",
    )
    assert not (tmp_path / "a.csv").exists()


def write_published(folder, score, single, multi):
    """Writes both files of the published form: a row for each tuple of clues, so scored."""
    matches = tuple((f"match{number}", score) for number in (1, 2, 3, 4))
    for name, kind, of_rows in zip(FILES, ("single", "multi"), (single, multi), strict=True):
        questions = [
            Question(
                f"{kind}{number}", f"Is there a mug {number}?", clues, ("yes",),
                published=PublishedColumns(kind, f"{kind}{number}", matches=matches),
            )
            for number, clues in enumerate(of_rows)
        ]  # fmt: skip
        write_questions(folder / name, questions)


def test_table4_is_printed_from_the_files_scores(tmp_path, run_cli):
    write_published(tmp_path, 0.5, [(0,)], [(0, 1), (0, 1, 2, 3)])
    code, out, err = run_cli("table", "4", tmp_path)
    assert (code, err) == (0, "")
    assert [line.split()[-6:] for line in out.splitlines() if "match3" in line] == [
        ["(1)", "50.00", "(1)", "50.00", "(3)", "5.0–95.0"]
    ]
    (tmp_path / FILES[1]).unlink()
    assert_refused(
        run_cli("table", "4", tmp_path),
        "no question for the column 2; give a folder with both published question files",
    )


@needs_published_sets
@pytest.mark.parametrize(
    ("file", "n", "reference", "strict"),
    [(FILES[0], 829, 75.64, 75.69), (FILES[1], 474, 70.66, 70.67)],
)
def test_who_sees_nothing_scores_this_on_the_published_files(evaluate, file, n, reference, strict):
    oracle, blind = (
        by_clues_of(evaluate(model, data=PUBLISHED_SETS / file))["total"]
        for model in ("oracle", "blind")
    )
    assert (oracle["n"], oracle["scores"]["strict"]["mean"]) == (n, 1.0)
    for metric, accuracy in (("reference", reference), ("strict", strict)):
        assert round(100 * blind["scores"][metric]["mean"], 2) == accuracy


def test_a_row_without_an_answer_is_told_by_every_command_that_takes_question_files(
    tmp_path, run_cli
):
    """One of two files of the published form has a bad row; whatever counts rows counts it, and
    goes on."""
    write_published(tmp_path, 1.0, [(1,), (2,), (3,)], [(1, 2), (1, 2, 3)])
    path = tmp_path / FILES[0]
    path.write_text(path.read_text().replace("mug 1?,[2],['yes']", "mug 1?,[2],"))
    log = tmp_path / "log.jsonl"
    log.write_text(
        "".join(json.dumps({"question_id": f"single{n}", "reply": "yes"}) + "\n" for n in range(3))
    )
    expected = f"{FILES[0]}, line 3: answer is empty; fill it or remove the row"
    output = tmp_path / "out"
    commands = (
        (0, ["table", "4", tmp_path]),
        (0, ["audit", tmp_path]),
        (1, ["import-replies", log, *option_words(data=tmp_path, model="m", out=output)]),
        (0, option_words(model="oracle", tasks="nieh_gt", data=tmp_path, out=output)),
    )
    for code, command in commands:
        ended, _, err = run_cli(*command)
        assert (ended, expected in " ".join(err.split())) == (code, True), (command, err)
        assert (
            command[0] != "import-replies"
            or "2 replies imported, 2 of 4 questions without one" in err
        )
