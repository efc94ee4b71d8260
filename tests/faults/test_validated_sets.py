"""Validation keeps what people filled in, reads it first, and mixes no two sets."""

import csv

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.baselines import BASELINES
from infthor_eval.nieh.suite import NiehSuite

from ..helpers.baselines import ScriptedBaseline
from ..helpers.command_line import assert_refused

ASKED = [
    Question("t", "Which two?", (1, 3), ("shelf",)),
    Question("t", "=HYPERLINK(1)", (1, 4), ("shelf",)),
    Question("t", "Is there?", (2,), ("yes",)),
]


@pytest.fixture
def asked(monkeypatch):
    """The questions that the model `silent` was asked; it answers nothing right."""
    asked = []
    silent = ScriptedBaseline("silent", lambda question: asked.append(question) or "=1+1")
    monkeypatch.setattr(NiehSuite, "baselines", {**BASELINES, "silent": lambda _: silent})
    return asked


@pytest.fixture
def validate(make_nieh_set, tmp_path, run_cli, asked):
    """Validates a set of one trajectory with that model."""
    data = make_nieh_set(ASKED, size=56)

    def validate(*options, data=data):
        return run_cli("validate", data, "--model", "silent", "--out", tmp_path / "v", *options)

    return validate


def _rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def _fill(path, decisions):
    rows = _rows(path)
    for row, decision in zip(rows, decisions, strict=True):
        row["decision"] = decision
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)


def test_decisions_in_the_list_stay_when_the_command_is_run_again(validate, tmp_path):
    assert validate()[0] == 0
    filled = tmp_path / "v" / "inspection.csv"
    _fill(filled, ["keep", "drop"])
    assert validate()[0] == 0
    assert [row["decision"] for row in _rows(filled)] == ["keep", "drop"]


def test_a_list_whose_questions_are_decided_is_kept_beside(validate, tmp_path):
    validate()
    filled = tmp_path / "v" / "inspection.csv"
    _fill(filled, ["keep", "drop"])
    content = filled.read_bytes()
    code, _, err = validate("--decisions", filled)
    assert code == 0
    assert (tmp_path / "v" / "inspection.1.csv").read_bytes() == content
    assert "inspection.1.csv: the earlier list" in err


def test_no_cell_of_the_list_is_a_formula_and_the_list_reads_back(validate, tmp_path):
    validate()
    filled = tmp_path / "v" / "inspection.csv"
    cells = [cell for row in _rows(filled) for cell in row.values()]
    assert "'=HYPERLINK(1)" in cells
    assert not any(cell.startswith(("=", "+", "-", "@")) for cell in cells)
    _fill(filled, ["keep", "keep"])
    assert validate("--decisions", filled)[0] == 0


def test_a_damaged_list_is_told_before_a_model_is_asked(validate, tmp_path, asked):
    (tmp_path / "v").mkdir()
    (tmp_path / "v" / "inspection.csv").write_text('question_id,decision\n"a,keep\n')
    assert_refused(validate(), "inspection.csv: not a UTF-8 CSV file")
    assert asked == []


def test_decisions_on_another_set_are_told_before_a_model_is_asked(validate, tmp_path, asked):
    (tmp_path / "d.csv").write_text("question_id,decision\nother/1,keep\n")
    assert_refused(
        validate("--decisions", tmp_path / "d.csv"), "about other/1, which is not in the set"
    )
    assert asked == []


def test_the_frames_of_another_set_are_no_place(validate, make_nieh_set, tmp_path):
    assert validate()[0] == 0
    other = make_nieh_set(ASKED, size=56, name="other")
    assert_refused(validate(data=other), "holds the frames of another set")


def test_a_link_that_leads_nowhere_is_no_place(validate, tmp_path):
    (tmp_path / "v").mkdir()
    (tmp_path / "v" / "metadata").symlink_to(tmp_path / "gone")
    assert_refused(validate(), "holds the frames of another set")
