"""What is damaged in a set, or fails in a model, costs its own questions alone."""

import csv
import json
import os
import shutil

import pytest
import torch
from PIL import Image

from infthor_eval.formats.question import Question
from model_adapters.hf.cached.decoding import Generation, ReplyState, extend_replies
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.protocols import Decoding

from ..conftest import QUESTIONS
from ..helpers.command_line import assert_refused, option_words, read_success
from ..helpers.questions import make_question
from ..helpers.refusals import assert_raises_one_line
from .test_files import IMAGES

SOUND = QUESTIONS


def _frame(data, traj_id, index):
    return data / "metadata" / traj_id / "img" / f"{index:09d}.png"


def _clue(change):
    """What changes a clue in a set."""
    return lambda data: change(_frame(data, "traj_b", 0))


def _log(change):
    """What changes the log of a trajectory of two questions."""
    return lambda data: change(data / "metadata/traj_b/metadata.json")


def _content(content):
    return lambda path: path.write_bytes(content)


def _twice(path):
    Image.new("RGB", (56, 56)).save(path.with_suffix(".jpg"))


def _remove(path):
    path.unlink()


def _pipe(path):
    path.unlink()
    os.mkfifo(path)


def _folder(path):
    path.unlink()
    path.mkdir()


def _rename(field, value):
    def rename(path):
        entries = json.loads(path.read_text())
        for entry in entries[:2]:
            entry[field] = value
        path.write_text(json.dumps(entries))

    return rename


# What is done to a set of five sound questions, and how many of them are answered and are skipped
# then.
SETS = {
    "a frame is missing that no question shows": (
        lambda data: _frame(data, "traj_a", 5).unlink(),
        5,
        0,
    ),
    "a clue is missing": (_clue(_remove), 4, 1),
    "a clue is a pipe": (_clue(_pipe), 4, 1),
    "a clue is a folder": (_clue(_folder), 4, 1),
    "a clue is a bomb": (_clue(_content(IMAGES["bomb"][0])), 4, 1),
    "a clue is a sliver": (_clue(_content(IMAGES["sliver"][0])), 4, 1),
    "a clue is no image": (_clue(_content(b"text")), 4, 1),
    "a log is gone": (_log(_remove), 3, 2),
    "a log is no JSON": (_log(_content(b"[")), 3, 2),
    "a log is deep": (_log(_content(b"[" * 200_000)), 3, 2),
    "a log is of another form": (_log(_content(b"5")), 3, 2),
    "a log is a pipe": (_log(_pipe), 3, 2),
    "a log names two frames alike": (_log(_rename("img_filename", "000000000.png")), 3, 2),
    "a log numbers two frames alike": (_log(_rename("img_idx", 0)), 3, 2),
    "two frames have one name": (_clue(_twice), 3, 2),
    "the images are gone": (lambda data: shutil.rmtree(data / "metadata/traj_b/img"), 3, 2),
    "a frame too many": (_clue(lambda path: shutil.copy(path, path.with_stem("000000077"))), 3, 2),
    "a row has no answer": (lambda data: _row(data, 2, answer=""), 4, 1),
    "rows have cells of another form": (
        lambda data: (_row(data, 0, answer="a"), _row(data, 3, gt_img_idx="1")),
        3,
        2,
    ),
    "a trajectory's name is too long": (lambda data: _ask(data, "n" * 300), 5, 1),
    "a trajectory's name has a null": (lambda data: _ask(data, "a\0b"), 5, 1),
    "a trajectory's name climbs": (lambda data: _ask(data, "../metadata/traj_b"), 5, 1),
}


def _row(data, number, **changes):
    (path,) = data.glob("qa_set*.csv")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    rows[number].update(changes)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def _ask(data, traj_id):
    with (data / "qa_set_more.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerows(
            [["traj_id", "question", "gt_img_idx", "answer"], [traj_id, "q", "[1]", "['a']"]]
        )


@pytest.mark.parametrize("name", SETS)
def test_what_is_damaged_in_a_set_costs_its_own_questions(make_nieh_set, tmp_path, run_cli, name):
    damage, n_answered, n_skipped = SETS[name]
    data = make_nieh_set(size=56)
    damage(data)
    arguments = option_words(model="oracle", tasks="nieh_gt", data=data, out=tmp_path / "out")
    _, err = read_success(run_cli(*arguments))
    assert f"{n_answered} evaluated now" in err
    skipped = [line for line in err.splitlines() if "sample(s) skipped: " in line]
    assert sum(int(line.split()[1]) for line in skipped) == n_skipped


LATE = {
    "a header of nonsense": _content(b"\xff\xd8\xff\xe0" + b"\xaa" * 300),
    "a cut header": _content(b"\x89PNG\r\n\x1a\n\0\0"),
    "pixels that are cut": lambda path: path.write_bytes(path.read_bytes()[:60]),
    "a sliver as JPEG": lambda path: Image.new("RGB", (60_000, 2)).save(path, format="JPEG"),
}


@pytest.mark.parametrize("batch_size", [1, 4])
@pytest.mark.parametrize("name", LATE)
def test_a_frame_that_no_model_can_take_fails_alone(
    make_nieh_set, tmp_path, run_cli, name, batch_size
):
    data = make_nieh_set(size=56)
    LATE[name](_frame(data, "traj_b", 0))
    arguments = option_words(
        model="qwen2.5-vl-tiny", model_args=f"batch_size={batch_size}", tasks="nieh_gt"
    )
    code, _, err = run_cli(*arguments, "--data", data, "--out", tmp_path / "out")
    assert code == 1
    assert "5 evaluated now" in err
    assert "nieh_gt: 1 sample(s) failed, in no score: " in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "error", [RuntimeError, ValueError, KeyError, ZeroDivisionError, OSError, MemoryError]
)
def test_what_an_adapter_raises_on_one_question_fails_alone(
    make_nieh_set, tmp_path, run_cli, monkeypatch, error
):
    reply = TransformersModel.answer_each

    def answer_each(self, conversations, decoding):
        if any("fridge" in str(turns[-1].parts[-1]) for turns in conversations):
            raise error("of its own")
        return reply(self, conversations, decoding)

    monkeypatch.setattr(TransformersModel, "answer_each", answer_each)
    arguments = ["--model", "qwen2.5-vl-tiny", "--model-args", "batch_size=4", "--tasks", "nieh_gt"]
    code, _, err = run_cli(*arguments, "--data", make_nieh_set(size=56), "--out", tmp_path / "out")
    assert code == 1
    assert "nieh_gt: 1 sample(s) failed, in no score: qwen2.5-vl-tiny fails on the request" in err


@pytest.mark.parametrize("batch_size", [1, 4])
def test_a_question_that_is_too_long_fails_alone(make_nieh_set, tmp_path, run_cli, batch_size):
    long = Question("traj_b", "Is there " + "a very large " * 2000 + "sink?", (0,), ("no",))
    data = make_nieh_set([*SOUND, long], size=56)
    model_args = f"batch_size={batch_size},max_tokens=1000"
    arguments = option_words(
        model="qwen2.5-vl-tiny", model_args=model_args, tasks="nieh_gt", data=data
    )
    code, _, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert code == 1
    assert "nieh_gt: 1 sample(s) failed" in err


@pytest.mark.parametrize("model", ["oracle", "qwen2.5-vl-tiny"])
def test_a_haystack_without_a_usable_question_ends_the_same_way(
    make_nieh_set, tmp_path, run_cli, model
):
    data = make_nieh_set([make_question(clues=(99,))], size=56)
    arguments = option_words(model=model, tasks="nieh_haystack_8k", data=data, out=tmp_path / "out")
    assert_refused(
        run_cli(*arguments),
        "can be asked (clue 99 is outside trajectory t (6 frames))",
        after_notes=True,
    )


def test_a_context_is_measured_by_a_frame_that_can_be_read(make_nieh_set, tmp_path, run_cli):
    questions = [make_question(), make_question("u")]
    data = make_nieh_set(questions, size=56)
    _frame(data, "t", 1).write_bytes(b"\xff\xd8\xff\xe0")
    arguments = ["--model", "qwen2.5-vl-tiny", "--tasks", "nieh_truncate_head_8k", "--data", data]
    code, _, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert code == 1
    assert "nieh_truncate_head_8k: 1 sample(s) failed" in err


@pytest.mark.parametrize("scores", [[torch.nan] * 4, [1.0, torch.nan, 2.0, 0.0], [-torch.inf] * 4])
@pytest.mark.parametrize("temperature", [0.0, 1.0])
def test_scores_that_are_no_numbers_are_no_answer(scores, temperature):
    decoding = Decoding(max_new_tokens=2, temperature=temperature)
    writing = ReplyState(
        Generation(frozenset()), decoding, context=(), choices=None, finished=lambda _: False
    )
    assert_raises_one_line(
        lambda: extend_replies([(writing, torch.tensor(scores))]), "no token has a score"
    )
