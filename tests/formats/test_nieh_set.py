import json
import shutil

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.set_info import claim_for_simulator

SOUND = Question("t", "Is there a mug?", (1,), ("yes",))


def frame_of(root, number):
    return root / "metadata" / "t" / "img" / f"{number:09d}.png"


def reasons(root):
    return [item.reason for item in NiehSet(root).skipped]


def test_frames_come_in_time_order_and_clues_in_theirs(make_nieh_set):
    root = make_nieh_set([Question("t", "q", (4, 1), ("yes",))])
    data = NiehSet(root)
    assert [frame.path.stem for frame in data.frames("t")] == [f"{index:09d}" for index in range(6)]
    clues = [frame.path.stem for frame in data.clue_frames(data.questions[0])]
    assert clues == ["000000004", "000000001"]
    assert data.skipped == ()


def test_columnar_metadata_without_file_names_is_read(make_nieh_set):
    root = make_nieh_set([SOUND])
    metadata = root / "metadata" / "t" / "metadata.json"
    metadata.write_text(json.dumps({"img_idx": list(range(6)), "step": list(range(6))}))
    assert NiehSet(root).clue_frames(SOUND)[0].path.name == "000000001.png"


def test_the_folder_of_larger_images_serves_as_well(make_nieh_set):
    root = make_nieh_set([SOUND])
    folder = root / "metadata" / "t"
    (folder / "img").rename(folder / "img_768")
    assert NiehSet(root).clue_frames(SOUND)[0].path.parent.name == "img_768"


@pytest.mark.parametrize(
    ("question", "reason"),
    [
        (Question("t", "q", (6,), ("a",)), "clue 6 is outside trajectory t (6 frames)"),
        (Question("t", "q", (-1,), ("a",)), "clue -1 is outside trajectory t (6 frames)"),
        (Question("t", "q", (), ("a",)), "no clue frame"),
        (Question("t", "q", (1,), ()), "no gold answer"),
        (
            Question("../metadata/t", "q", (1,), ("a",)),
            "trajectory '../metadata/t' is not a plain folder name",
        ),
    ],
)
def test_a_question_that_cannot_be_asked_is_left_out_with_its_reason(
    make_nieh_set, question, reason
):
    root = make_nieh_set([SOUND])
    extra = root / "qa_set_extra.csv"
    rows = f'"{question.traj_id}",q,"{list(question.clues)}","{list(question.answers)}"\n'
    extra.write_text("traj_id,question,gt_img_idx,answer\n" + rows)
    assert reasons(root) == [reason]
    assert [item.text for item in NiehSet(root).questions] == [SOUND.text]


def test_a_trajectory_without_folder_and_a_repeated_question_are_left_out(make_nieh_set):
    root = make_nieh_set([SOUND, SOUND])
    (root / "qa_set_x.csv").write_text("traj_id,question,gt_img_idx,answer\nother,q,[1],['a']\n")
    assert reasons(root) == ["is in the files twice", "trajectory other is not in metadata/"]


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda frame: frame.write_text("not an image"), "not a PNG, JPEG or WebP image"),
        (
            lambda frame: frame.rename(frame.with_name("other.png")),
            "cannot be read (No such file or directory)",
        ),
    ],
)
def test_a_clue_that_is_no_image_or_has_another_name_is_left_out_by_name(
    make_nieh_set, spoil, reason
):
    root = make_nieh_set([SOUND])
    spoil(frame_of(root, 1))
    assert reasons(root) == [f"{frame_of(root, 1)}: {reason}"]


def test_a_frame_without_an_entry_leaves_the_questions_of_its_trajectory_out(make_nieh_set):
    root = make_nieh_set([SOUND, Question("u", "Is there a mug?", (1,), ("yes",))])
    frame_of(root, 6).write_bytes(frame_of(root, 5).read_bytes())
    reason = (
        "trajectory t: 7 frames but 6 entries in metadata.json (none for 000000006); unpack the "
        "trajectory again"
    )
    assert reasons(root) == [reason]
    assert [question.traj_id for question in NiehSet(root).questions] == ["u"]


def test_a_missing_frame_leaves_out_the_questions_that_show_it(make_nieh_set):
    root = make_nieh_set([SOUND, Question("t", "Is there a sink?", (5,), ("yes",))])
    frame = frame_of(root, 5)
    frame.unlink()
    assert reasons(root) == [f"{frame}: cannot be read (No such file or directory)"]
    assert len(NiehSet(root).questions) == 1
    assert NiehSet(root).fingerprint


def test_two_frames_with_one_number_are_refused(make_nieh_set):
    root = make_nieh_set([SOUND])
    metadata = root / "metadata" / "t" / "metadata.json"
    entries = json.loads(metadata.read_text())
    metadata.write_text(json.dumps([{**entry, "img_idx": 0} for entry in entries]))
    assert "two entries of metadata.json have img_idx 0" in reasons(root)[0]


def test_missing_parts_of_a_set_are_named(make_nieh_set, tmp_path):
    with pytest.raises(DataError, match="no such folder"):
        NiehSet(tmp_path / "nowhere")
    with pytest.raises(DataError, match=r"no qa_set\*\.csv"):
        NiehSet(tmp_path)
    with pytest.raises(DataError, match="no metadata/"):
        NiehSet(tmp_path, needs_questions=False)


def test_question_files_alone_are_a_set_without_frames(make_nieh_set):
    root = make_nieh_set([SOUND])
    whole = NiehSet(root)
    questions, fingerprint = whole.questions, whole.fingerprint
    shutil.rmtree(root / "metadata")
    (file,) = root.glob("qa_set*.csv")
    for place in (root, file):
        data = NiehSet(place)
        assert (data.has_frames, data.questions, data.skipped) == (False, questions, ())
        assert data.fingerprint != fingerprint
        with pytest.raises(DataError, match=f"{place}: has no metadata/ with frames; unpack"):
            data.frames("t")


def test_the_fingerprint_follows_questions_logs_and_frames(make_nieh_set):
    root = make_nieh_set([SOUND])
    before = NiehSet(root).fingerprint
    assert NiehSet(root).fingerprint == before
    frame = frame_of(root, 3)
    frame.write_bytes(frame.read_bytes() + b"more")
    assert NiehSet(root).fingerprint != before


def test_the_simulator_is_what_the_set_says(make_nieh_set):
    root = make_nieh_set([SOUND])
    assert NiehSet(root).simulator is None
    (root / "set.json").write_text('{"simulator": "embedded"}')
    assert NiehSet(root).simulator == "embedded"
    (root / "set.json").write_text("[]")
    with pytest.raises(DataError, match="not a JSON object"):
        NiehSet(root)


def test_a_set_of_another_version_is_refused(make_nieh_set):
    root = make_nieh_set([SOUND])
    (root / "set.json").write_text('{"format": 99, "simulator": "embedded"}')
    with pytest.raises(
        DataError, match=r"set\.json: the set has format 99, this version reads 1; use the version"
    ):
        NiehSet(root)


def test_a_set_is_continued_by_the_same_simulator_of_the_same_version_alone(tmp_path):
    claim_for_simulator(tmp_path, "embedded")
    (tmp_path / ".set.json.lock").touch()  # of a process that was killed just then
    claim_for_simulator(tmp_path, "embedded")
    assert [path.name for path in tmp_path.iterdir()] == ["set.json"]
    with pytest.raises(
        DataError, match="of the embedded simulator; give another folder for the unity one"
    ):
        claim_for_simulator(tmp_path, "unity")
    info = json.loads((tmp_path / "set.json").read_text())
    (tmp_path / "set.json").write_text(json.dumps(info | {"infthor_eval": "0.0.1"}))
    with pytest.raises(DataError, match=r"rendered by version 0\.0\.1, this is"):
        claim_for_simulator(tmp_path, "embedded")
