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


EVALUATED = {
    "evaluation_id": "e",
    "sample_id": "q0",
    "model_id": "m/n",
    "output": {"raw": ["yes"]},
    "evaluation": {"score": 1.0, "is_correct": True},
}


def test_a_reply_that_is_there_for_each_metric_comes_once(read):
    rows = [{**EVALUATED, "evaluation_name": name} for name in ("exact", "f1")]
    assert read(*rows) == [LoggedReply(1, "yes", "q0", model="m/n")]


def test_several_replies_in_a_row_are_repetitions(read):
    drawn = read({**EVALUATED, "output": {"raw": ["yes", "no", "yes"]}})
    assert [(reply.text, reply.repeat) for reply in drawn] == [("yes", 1), ("no", 2), ("yes", 3)]


def test_what_exports_say_beside_their_format(read):
    told = {"question_id": "q7", "task": "t", "context": "clues", "variant": "depth=0.4"}
    told |= {"repeat": "2", "frames": "0-2,7", "frame_ablation": "blank"}
    (reply,) = read({**EVALUATED, "sample_id": "q7 depth=0.4 (2)", "metadata": told})
    said = {"model": "m/n", "task": "t", "context": "clues", "frame_ablation": "blank"}
    said |= {"variant": "depth=0.4", "repeat": 2, "frames": (0, 1, 2, 7)}
    assert reply == LoggedReply(1, "yes", "q7", **said)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"output": None}, "an episode, and no reply to a question"),
        ({"output": {"raw": []}}, "output.raw is empty"),
        ({"metadata": {"frames": "0-999999999"}}, "are more than 1,000,000"),
        ({"sample_id": 3}, "Expected `str`, got `int`"),
    ],
)
def test_a_row_without_a_reply_is_a_bad_one(read, changes, reason):
    bad, good = read({**EVALUATED, **changes}, EVALUATED)
    assert isinstance(bad, UnreadRow)
    assert reason in bad.reason
    assert good.text == "yes"


def test_a_failed_sample_has_its_reason(read):
    (reply,) = read({**EVALUATED, "output": {"raw": []}, "error": "the server says no"})
    assert (reply.text, reply.failure) == ("", "the server says no")


def test_a_pair_is_no_reply(read):
    assert read({**EVALUATED, "metadata": {"members": '["q0", "q1"]'}}) == []
