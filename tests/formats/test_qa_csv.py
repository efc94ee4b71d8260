import csv
import re
import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.formats.qa_csv import read_questions, write_questions
from infthor_eval.formats.question import PublishedColumns, Question

from ..helpers.refusals import read_one_line

words = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=20)
questions = st.builds(
    Question,
    traj_id=words,
    text=words,
    clues=st.lists(st.integers(0, 3000), max_size=5).map(tuple),
    answers=st.lists(words | st.integers(-(2**62), 2**62), max_size=3).map(tuple),
    question_type=words | st.none(),
    absence=st.booleans(),
)


@given(st.lists(questions, max_size=5))
def test_what_is_written_is_read_back(tmp_path_factory, items):
    path = tmp_path_factory.mktemp("csv") / "qa_set.csv"
    write_questions(path, items)
    assert read_questions(path) == items


@given(
    st.sampled_from(["single", "multi"]),
    st.lists(
        st.builds(
            PublishedColumns,
            file=st.just("single"),
            qid=words,
            n_evidence=st.integers(0, 20) | st.none(),
            steps=st.lists(st.integers(0, 3000), max_size=5).map(tuple),
            matches=st.tuples(*[st.floats(0, 2)] * 4).map(
                lambda scores: tuple((f"match{n}", score) for n, score in enumerate(scores, 1))
            ),
        ),
        max_size=5,
        unique_by=lambda published: published.qid,
    ),
)
def test_all_columns_of_the_published_files_are_kept(tmp_path_factory, file, published):
    path = tmp_path_factory.mktemp("csv") / f"qa_set_nieh_{file}_clue.csv"
    items = [
        Question("t", "q", (1,), ("a",), published=replace(columns, file=file))
        for columns in published
    ]
    write_questions(path, items)
    assert read_questions(path) == items
    assert [item.id for item in items] == [columns.qid for columns in published]


@pytest.mark.parametrize(
    ("column", "cell", "expected"),
    [
        ("match2", "half", "num_evidence or one of match1 to match4 is not a number"),
        ("match2", "nan", "one of match1 to match4 is not finite"),
        ("num_evidence", "two", "num_evidence or one of match1 to match4 is not a number"),
        ("gt_steps", "7", "gt_steps is not a list"),
    ],
)
def test_a_bad_cell_of_a_published_column_is_named(tmp_path, column, cell, expected):
    path = tmp_path / "qa_set_nieh_single_clue.csv"
    rows = f"t,q,[1],['a'],{cell}\nt,q,[1],['a'],\n"
    path.write_text(f"traj_id,question,gt_img_idx,answer,{column}\n{rows}")
    bad, good = read_questions(path)
    assert f"qa_set_nieh_single_clue.csv, line 2: {expected}" in bad.reason
    assert good.answers == ("a",)


def test_the_published_columns_suffice_and_others_are_left_unread(tmp_path):
    path = tmp_path / "qa_set_nieh.csv"
    path.write_text("idx,traj_id,question,gt_img_idx,answer\n0,t1,\"Is it, there?\",[12],['yes']\n")
    assert read_questions(path) == [Question("t1", "Is it, there?", (12,), ("yes",))]


HEADER = "traj_id,question,gt_img_idx,answer"


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("traj_id,question,answer\nt,q,['a']", "no column gt_img_idx"),
        ("", "no column traj_id"),
        (f"{HEADER}\nt,q,\"[1, 2\",['a']", "line 2: gt_img_idx is not a list"),
        (f"{HEADER}\nt,q,[1],yes", "line 2: answer is not a list"),
        (f"{HEADER}\nt,q,[1],__import__('os')", "line 2: answer is not a list"),
        (f"{HEADER}\nt,q,['x'],['a']", "line 2: gt_img_idx has an entry of the wrong type"),
        (f"{HEADER}\nt,q,[True],['a']", "wrong type"),
        (f"{HEADER},absence\nt,q,[1],['no'],maybe", "line 2: absence is neither yes nor no"),
        (f"{HEADER}\nt,,[1],['a']", "line 2: question is empty"),
        (f"{HEADER}\nt,q", "line 2: gt_img_idx is empty"),
        (f"{HEADER}\nt,q,{'[' * 5000},['a']", "gt_img_idx is not a list"),
    ],
)
def test_a_malformed_file_is_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "qa_set.csv"
    path.write_text(f"{content}\n" if content else "")
    with pytest.raises(DataError, match=re.escape(str(path))) as caught:
        read_questions(path)
    message = read_one_line(caught)
    assert expected in message
    assert len(message) < len(str(path)) + 200


ROWS = {  # rows among good ones: what is said of each
    "t,q,[1],": "answer is empty; fill it or remove the row",
    ",q,[1],['a']": "traj_id is empty",
    "t,q,[1],['a'],x,y,z": "has 7 cells for 5 columns",
    "t,q,[1],['a'],perhaps": "absence is neither yes nor no",
    "t,\"q\nq\",[1],['a']": "question has several lines; close its quote",
    "t,q,[1],[nan]": "answer is not a list",
    "t,q,[1],[1e999]": "answer has an entry that no reply can match",
    "t,q,1,['a']": "gt_img_idx is not a list",
}


def test_a_bad_row_costs_itself_alone_and_names_its_line(tmp_path):
    path, good = tmp_path / "qa_set.csv", "t,q,[1],['a'],"
    lines = [line for row in ROWS for line in (row, good)]
    path.write_text("\n".join(["traj_id,question,gt_img_idx,answer,absence", *lines]) + "\n")
    items = read_questions(path)
    assert [isinstance(item, Question) for item in items] == [False, True] * len(ROWS)
    line = 2
    for item, (row, expected) in zip(items[::2], ROWS.items(), strict=True):
        line += row.count("\n")
        assert item.reason.startswith(f"qa_set.csv, line {line}: {expected}")
        line += 2


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "qa_set.csv"
    path.write_bytes(b"traj_id,\xff\xfe")
    with pytest.raises(DataError, match="not UTF-8 text"):
        read_questions(path)
    with pytest.raises(DataError, match="cannot be read"):
        read_questions(tmp_path / "none.csv")


def test_no_cell_is_a_formula_and_all_are_read_as_they_were(tmp_path):
    texts = ["=1+1", "+A1 is it?", "-A1", "@SUM(A1)", "'=A1", "-3.2"]
    questions = [Question("=traj", text, (1,), ("=mug",)) for text in texts]
    path = tmp_path / "qa.csv"
    write_questions(path, questions)
    rows = list(csv.reader(path.read_text().splitlines()))[1:]
    assert [row[0][0] for row in rows] == ["'"] * len(texts)
    assert [row[1] for row in rows] == [*(f"'{text}" for text in texts[:-1]), "-3.2"]
    assert [(item.traj_id, item.text) for item in read_questions(path)] == [
        ("=traj", text) for text in texts
    ]


def test_a_cell_of_200_mb_is_refused_with_its_line_in_a_small_memory(tmp_path):
    path = tmp_path / "qa_set.csv"
    with path.open("wb") as file:
        file.write(b"traj_id,question,gt_img_idx,answer\nt,q,[1],['a']\nt,")
        for _ in range(200):
            file.write(b"x" * 10**6)
        file.write(b",[1],['a']\n")
    code = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from infthor_eval.errors import DataError\n"
        "from infthor_eval.formats.csv_files import read_rows\n"
        "pages = int(open('/proc/self/statm').read().split()[0])\n"
        "small = pages * resource.getpagesize() + 150 * 2**20\n"
        "resource.setrlimit(resource.RLIMIT_AS, (small, small))\n"
        "try:\n"
        "    list(read_rows(Path(sys.argv[1]), ['question'], 'fix it'))\n"
        "except DataError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert "qa_set.csv, line 3: is longer than 16 MiB; if this is intended, set" in done.stdout
