"""Published logs of plans: what is read, and what is not."""

import gzip
import json

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.plan_logs import is_plan_log, read_plan_log

NAME = "eval_longhrz_checkpoints_some-model_step-5-hf_yarn_4.0.log"


def row(traj_id, total, goto, pick, put):
    """A row as the published scripts write it; each count is (done, plans)."""
    metric = {"total_count": total[1], "success_count": total[0], "agent_reward": 0}
    for name, (done, plans) in {"goto": goto, "pick": pick, "put": put}.items():
        metric |= {f"{name}_count": plans, f"{name}_success": done}
    return {"traj_id": traj_id, "metric": metric}


ROWS = [row("t0", (1, 4), (1, 2), (0, 1), (0, 1)), row("t1", (0, 0), (0, 0), (0, 0), (0, 0))]


@pytest.fixture
def read(tmp_path):
    def read(lines, name=NAME):
        content = "".join(
            line if isinstance(line, str) else json.dumps(line) + "\n" for line in lines
        ).encode()
        path = tmp_path / name
        path.write_bytes(gzip.compress(content, mtime=0) if name.endswith(".gz") else content)
        return read_plan_log(path)

    return read


@pytest.mark.parametrize("name", [NAME, f"{NAME}.gz"])
def test_the_counts_of_each_trajectory_are_read(read, name):
    log = read(ROWS, name)
    first, second = log.rows
    assert (first.line, first.traj_id) == (1, "t0")
    counts = (first.goto, first.pick, first.put, first.total)
    assert counts == ((1, 2), (0, 1), (0, 1), (1, 4))
    assert (second.traj_id, second.total, log.unread) == ("t1", (0, 0), ())
    assert is_plan_log(log.path)


@pytest.mark.parametrize(
    ("name", "model"),
    [
        (NAME, "some-model_step-5-hf_yarn_4.0"),
        ("eval_longhrz_checkpoints_memory-text_step-6-hf_.log.gz", "memory-text_step-6-hf"),
        ("mine.log", None),
    ],
)
def test_the_model_is_in_a_published_name(read, name, model):
    assert read(ROWS, name).model == model


def test_packing_does_not_change_the_digest(read):
    plain, packed, other = read(ROWS), read(ROWS, f"{NAME}.gz"), read(ROWS[:1], "other.log")
    assert plain.digest == packed.digest != other.digest


NONE = ((0, 1), (0, 1))  # pick-ups and puts
BAD = {
    "cut": (json.dumps(ROWS[0])[:50] + "\n", "has no counts of plans ("),
    "a list": ("[1]\n", "has no counts of plans (Expected `object`, got `array`)"),
    "nested": ("[" * 5000 + "\n", "has no counts of plans ("),
    "a count is missing": ({"traj_id": "t2", "metric": {"total_count": 4}}, "missing required"),
    "a word": (row("t2", (0, "4"), (0, 2), (0, 1), (0, 1)), "Expected `int`, got `str`"),
    "below zero": (row("t2", (0, 4), (-1, 2), (0, 1), (0, 1)), "Expected `int` >= 0"),
    "endless": (row("t2", (0, 10**9), (0, 2), (0, 1), (0, 1)), "Expected `int` <= 10000"),
    "no name": (row("", (0, 4), (0, 2), (0, 1), (0, 1)), "Expected `str` of length >= 1"),
    "more done": (row("t2", (3, 4), (3, 2), (0, 1), (0, 1)), "more plans are done than there are"),
    "too small a total": (row("t2", (1, 3), (1, 2), *NONE), "is less than its kinds together"),
    "the same again": (row("t0", (0, 4), (0, 2), *NONE), "has 't0' again; the first row is kept"),
}


@pytest.mark.parametrize("bad", BAD)
def test_a_bad_line_is_named_and_the_others_are_read(read, bad):
    line, reason = BAD[bad]
    log = read([ROWS[0], line, ROWS[1]])
    assert [item.traj_id for item in log.rows] == ["t0", "t1"]
    (unread,) = log.unread
    assert unread.line == 2
    assert reason in unread.reason


@pytest.mark.parametrize(
    ("lines", "reason"),
    [([], "it is empty"), (["{}\n"], "line 1 has no counts of plans (Object missing required")],
)
def test_a_log_without_counts_is_one_line(read, lines, reason):
    with pytest.raises(DataError, match="no line has counts of plans") as caught:
        read(lines)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "is_one"),
    [
        ('{"qidx": 0}\n', False),
        ("", False),
        ('half a line\n{"metric": {}}\n', True),
        ('[1]\n{"reply": ""}', False),
    ],
)
def test_a_log_of_plans_is_told_from_one_of_replies(tmp_path, content, is_one):
    path = tmp_path / "a.log"
    path.write_text(content)
    assert is_plan_log(path) == is_one
