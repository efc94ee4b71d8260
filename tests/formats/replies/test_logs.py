"""Rows of logs with replies: the fields on the frames that were shown."""

import json

import pytest

from infthor_eval.formats.replies.logged import LoggedReply, UnreadRow
from infthor_eval.formats.replies.logs import read_reply_log

NEUTRAL = {"question_id": "q0", "reply": "yes"}
PUBLISHED = {
    "qidx": 3,
    "traj_id": "t",
    "question": "Where is Mug now?",
    "gt_img_idx": [5],
    "gt_answer": ["Bed"],
    "llm_response": "bed",
}


@pytest.fixture
def read(tmp_path):
    def read(*rows):
        path = tmp_path / "log.jsonl"
        path.write_text("".join(f"{json.dumps(row)}\n" for row in rows))
        return list(read_reply_log(path))

    return read


def test_a_neutral_row_can_name_the_frames_that_were_shown(read):
    named, empty, silent = read(
        {**NEUTRAL, "frames_shown": [4, 2]}, {**NEUTRAL, "frames_shown": []}, NEUTRAL
    )
    assert (named.frames, empty.frames, silent.frames) == ((4, 2), (), None)
    assert silent == LoggedReply(3, "yes", "q0")


def test_a_published_row_names_them_in_its_own_words(read):
    rows = read(
        {**PUBLISHED, "eval_mode": "truncate_head", "n_imgs": 2, "selected_img_indices": [8, 9]},
        PUBLISHED,
    )
    assert [(row.row, row.mode, row.n_frames, row.frames) for row in rows] == [
        (3, "truncate_head", 2, (8, 9)),
        (3, None, None, None),
    ]
    assert rows[0].published.clues == (5,)


@pytest.mark.parametrize("frames", ["3", [1.5], ["1"], {"1": 2}, 4])
@pytest.mark.parametrize(
    ("row", "name"), [(NEUTRAL, "frames_shown"), (PUBLISHED, "selected_img_indices")]
)
def test_frames_that_are_no_whole_numbers_make_a_bad_row(read, row, name, frames):
    (bad, good) = read({**row, name: frames}, row)
    assert isinstance(bad, UnreadRow)
    assert name in bad.reason
    assert (good.line, good.frames) == (2, None)
