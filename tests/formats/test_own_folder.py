import pytest
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import Layout, layout_of, read_steps
from infthor_eval.nieh.scoring import score
from infthor_eval.nieh.twins import paired_with


@pytest.fixture
def make_folder(tmp_path):
    """Return a function that writes pictures of these names and the lines of a CSV file."""

    def write(names, *lines):
        for name in names:
            (tmp_path / name).parent.mkdir(exist_ok=True)
            Image.new("RGB", (28, 28)).save(tmp_path / name)
        (tmp_path / "questions.csv").write_text("\n".join(lines) + "\n")
        return tmp_path

    return write


def clue_names(data):
    return [[frame.name for frame in data.clue_frames(row)] for row in data.questions]


def test_frames_come_in_the_order_of_the_numbers_in_their_names(make_folder):
    root = make_folder(["f10.png", "f2.png", "f1.jpg"], "question,answer", "q,yes")
    data = NiehSet(root)
    (question,) = data.questions
    names = ["f1.jpg", "f2.png", "f10.png"]
    assert [frame.name for frame in data.frames(question.traj_id)] == names
    assert question.clues == (0, 1, 2), "without clue frames all are"
    assert question.answers == ("yes",)
    assert layout_of(root) is Layout.NONE
    assert [step.img_filename for step in read_steps(root)] == names


@pytest.mark.parametrize(
    ("names", "cell", "clues"),
    [
        (["3.png", "0004.png", "5.png"], "4", ["0004.png"]),  # numbers are names
        (["a.png", "b.png", "c.png"], '"1, c, a.png"', ["b.png", "c.png", "a.png"]),
    ],
)
def test_clue_frames_are_names_or_numbers(make_folder, names, cell, clues):
    data = NiehSet(make_folder(names, "question,answer,clue_frames", f"q,yes,{cell}"))
    assert clue_names(data) == [clues]


def test_each_trajectory_has_a_folder_of_its_own(make_folder):
    names = ["a/1.png", "b/1.png", "b/2.png"]
    lines = ("trajectory,question,answer,clue_frames", "b,q,yes,2", "a,q,no,", "c,q,no,", "a,q,,")
    data = NiehSet(make_folder(names, *lines))
    assert [(row.traj_id, row.clues) for row in data.questions] == [("b", (1,)), ("a", (0,))]
    assert [row.reason for row in data.skipped] == [
        "questions.csv, line 4: trajectory is not the name of a folder of frames; it is one of "
        "a, b",
        "questions.csv, line 5: answer is empty; fill it or remove the row",
    ]


def test_the_fingerprint_is_that_of_questions_and_frames(make_folder):
    root = make_folder(["1.png", "2.png"], "question,answer", "q,yes")
    before = NiehSet(root).fingerprint
    assert NiehSet(root).fingerprint == before
    (root / "2.png").rename(root / "3.png")
    assert NiehSet(root).fingerprint != before


@pytest.mark.parametrize(
    ("names", "lines", "message"),
    [
        (["1.png"], ["question,reply", "q,a"], "no column answer"),
        (["1.png"], ["question,answer"], "no row is a question \\(it has none\\)"),
        (["1.png"], ["question,answer,clues", "q,a,1"], "'clues' is not known; did you mean"),
        (["1.png"], ["question,answer,Trajectory", "q,a,1"], "did you mean trajectory?"),
        (["1.png"], ["question,answer,clue_frames", "q,a,7"], "an entry that is no frame"),
        (["1.png", "1.jpg"], ["question,answer", "q,a"], "two frames have the name 1"),
        (["1.png", "a/1.png"], ["question,answer", "q,a"], "frames in itself and in a/"),
        ([], ["question,answer", "q,a"], "has no qa_set"),
    ],
)
def test_a_folder_that_cannot_be_used_is_refused_in_one_line(make_folder, names, lines, message):
    root = make_folder(names, *lines)
    with pytest.raises(DataError, match=message) as error:
        NiehSet(root)
    assert "\n" not in str(error.value)


def test_columns_of_ones_own_are_ignored(make_folder):
    columns = "question,answer,clue_frames,frames,note,difficulty"
    root = make_folder(["1.png", "2.png"], columns, "q,a,2,many,mine,hard")
    assert clue_names(NiehSet(root)) == [["2.png"]]


def test_several_csv_files_are_refused(make_folder):
    root = make_folder(["1.png"], "question,answer", "q,a")
    (root / "more.csv").write_text("question,answer\n")
    with pytest.raises(DataError, match=r"several CSV files \(more.csv, questions.csv\)"):
        NiehSet(root)


def test_its_file_is_the_set_as_well_and_may_be_one_of_several(make_folder):
    folder = make_folder(["0.png", "1.png"], "question,answer", "Is there a mug?,yes")
    (folder / "more.csv").write_text("question,answer\nIs there a plate?,no\n")
    for name, text in (("questions.csv", "Is there a mug?"), ("more.csv", "Is there a plate?")):
        (question,) = NiehSet(folder / name).questions
        assert (question.text, question.clues) == (text, (0, 1))


def test_a_question_file_of_the_published_form_beside_pictures_is_read_as_such(make_folder):
    folder = make_folder(["0.png"], "question,answer", "Is there a mug?,yes")
    row = "t,Is there a plate?,[3],['no']"
    (folder / "qa.csv").write_text(f"traj_id,question,gt_img_idx,answer\n{row}\n")
    (question,) = NiehSet(folder / "qa.csv").questions
    assert (question.traj_id, question.clues) == ("t", (3,))


@pytest.mark.parametrize(
    ("cell", "answers"),
    [
        ("plate | mug", ("plate", "mug")),
        ('"[""plate"", 2]"', ("plate", 2)),
        ('"plate, mug"', ("plate, mug",)),
    ],
)
def test_several_answers_are_all_required(make_folder, cell, answers):
    (question,) = NiehSet(make_folder(["1.png"], "question,answer", f"q,{cell}")).questions
    assert question.answers == answers
    assert score(", ".join(map(str, reversed(answers))), answers, "strict") == 1


def test_a_pair_is_two_moments_of_a_trajectory(make_folder):
    lines = ("q,table,1,2.png,mug", "q,sink,3,,mug", "r,no,,2,")
    data = NiehSet(
        make_folder(["1.png", "2.png", "3.png"], "question,answer,clue_frames,moment,pair", *lines)
    )
    first, second, alone = data.questions
    assert [(row.moment, row.clues) for row in data.questions] == [
        (1, (0,)), (2, (2,)), (1, (0, 1))
    ]  # fmt: skip
    assert paired_with(data, first) == second and not data.twins
    assert alone.pair == ""


@pytest.mark.parametrize(
    ("lines", "reasons"),
    [
        (["a,q,x,1,p"], ["line 3: pair: 'p' is in 1 row; write it in those of its two questions"]),
        (["a,q,x,1,p", "a,r,x,1,p", "a,s,x,1,p"], ["pair: 'p' is in 3 rows"] * 3),
        (["a,q,x,1,p", "b,q,y,1,p"], ["pair: 'p' is on two trajectories"] * 2),
        (["a,q,x,1,p", "a,q,x,1,p"], ["pair: both questions of 'p' are the same"] * 2),
        (
            ["a,q,x,1,p", "a,r,,1,p"],
            ["line 3: pair: the other question of 'p' cannot be asked", "line 4: answer is empty"],
        ),
        # What only the file of a frame says.
        (
            ["a,q,x,1,p", "a,r,x,2,p"],
            ["pair: the other question of 'p' cannot be asked", "not a PNG"],
        ),
    ],
)
def test_half_a_pair_is_not_asked(make_folder, lines, reasons):
    names = ["a/1.png", "a/2.png", "b/1.png"]
    header = "trajectory,question,answer,clue_frames,pair"
    root = make_folder(names, header, "a,good,yes,1,", *lines)
    (root / "a/2.png").write_text("broken")
    data = NiehSet(root)
    assert [row.text for row in data.questions] == ["good"]
    for row, reason in zip(data.skipped, reasons, strict=True):
        assert reason in row.reason
    assert data.fingerprint


@pytest.mark.parametrize("name", ["comment", "part", "moments", "pairs", "clue_second"])
def test_short_columns_are_misspelt_only_where_that_is_plain(make_folder, name):
    root = make_folder(["1.png"], f"question,answer,{name}", "q,a,b")
    if name in ("comment", "part"):
        assert NiehSet(root).questions
        return
    with pytest.raises(DataError, match="did you mean"):
        NiehSet(root)
