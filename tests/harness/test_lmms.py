"""Our tasks for lmms-eval: the requests are ours, and so are the numbers of the same replies."""

import importlib
import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import datasets
import pytest
import yaml
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.writing import pack_set
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import WITHHELD, Question
from infthor_eval.harness import lmms
from infthor_eval.harness.lmms import docs
from infthor_eval.nieh.samples import find_samples
from infthor_eval.pairs import PAIR_BOUNDS
from infthor_eval.storage.folders import packaged_folder

from ..helpers.command_line import read_success
from ..helpers.twin_sets import write_twin_set

TWINS, MOMENTS = "infthor_twins_gt", "infthor_moments_gt"
# lmms-eval's wheel and four small packages that it imports: `make test-all` sets them aside.
PACKAGES = Path(os.environ.get("LMMS_EVAL_PACKAGES", f"{sys.prefix}/lmms-eval"))
PROGRAM = Path(__file__).with_name("lmms_eval_run.py")
REPLIES = ("oracle", "yes", "random", "exchanged")


class Task:
    """A task as lmms-eval 0.7.3 loads and scores it; places in its source are in comments."""

    def __init__(self, name, cache):
        self.config = self._read(lmms.PATH / f"{name}.yaml")
        # lmms_eval/api/task.py:1151-1166
        found = datasets.load_dataset(
            path=self.config["dataset_path"],
            cache_dir=str(cache),
            num_proc=1,
            **self.config["dataset_kwargs"],
        )
        self.docs = self.config["process_docs"](found[self.config["test_split"]])

    def _read(self, path):
        """See lmms_eval/utils.py:1023-1059: an included file first, then the file's own keys."""

        class Loader(yaml.FullLoader):
            pass

        Loader.add_constructor("!function", self._import)
        config = yaml.load(path.read_text(), Loader)
        if "include" in config:
            config = self._read(path.parent / config.pop("include")) | config
        return config

    @staticmethod
    def _import(loader, node):
        """See lmms_eval/utils.py:952-958, where there is no such file beside the task file."""
        module, _, name = loader.construct_scalar(node).rpartition(".")
        return getattr(importlib.import_module(module), name)

    def results(self, replies):
        """See lmms_eval/api/task.py:1583-1595 and evaluator.py:1388-1394: a value of each doc under
        its metric's name, and all values of a metric to its aggregation, without pictures."""
        values = {}
        for doc in self.docs.remove_columns("clue_frames"):
            said = [replies[doc["id"]].strip()]
            for metric, value in self.config["process_results"](doc, said).items():
                values.setdefault(metric, []).append(value)
        mean = {"mean": lambda scores: sum(scores) / len(scores)}
        aggregations = {it["metric"]: it["aggregation"] for it in self.config["metric_list"]}
        assert values.keys() <= aggregations.keys()
        return {
            metric: mean.get(aggregations[metric], aggregations[metric])(found)
            for metric, found in values.items()
        }


def replies_of(rows):
    """Replies to all questions, by who gave them and question."""
    draw = random.Random(3)
    said = sorted({answer for row in rows for answer in row["answer"]})
    by_pair = {}
    for row in rows:
        by_pair.setdefault(row["pair"], []).append(row)
    others = {
        row["id"]: other["answer"]
        for one, two in by_pair.values()
        for row, other in ((one, two), (two, one))
    }
    say = {
        "oracle": lambda row: ", ".join(row["answer"]),
        "yes": lambda row: "yes",
        "random": lambda row: draw.choice([draw.choice(said), ", ".join(row["answer"])]),
        "exchanged": lambda row: ", ".join(others[row["id"]]),
    }
    return {who: {row["id"]: say[who](row) for row in rows} for who in REPLIES}


@pytest.fixture
def ours(tmp_path, run_cli):
    """The numbers of our own suite for replies to the questions of a set."""

    def ours(data, replies):
        log = tmp_path / "replies.jsonl"
        rows = ({"question_id": name, "reply": reply} for name, reply in replies.items())
        log.write_text("\n".join(map(json.dumps, rows)))
        out = tmp_path / "ours"
        words = ("--data", data, "--model", "me", "--out", out)
        read_success(run_cli("import-replies", log, *words))
        (file,) = out.rglob("results.json")
        (task,) = json.loads(file.read_text())["summary"]["tasks"].values()
        total = task["by_clues"]["total"]["scores"]
        metrics = {name: it["mean"] for name, it in total.items()}
        shutil.rmtree(out)
        return metrics | {name: task["pairs"][name]["mean"] for name in PAIR_BOUNDS}

    return ours


def packed(root, twins_too=True, more=()):
    """A packed set of two pairs of worlds, or of no twins, and further questions."""
    folder = write_twin_set(root / "set")
    if not twins_too:
        (folder / "qa_set_twins.csv").unlink()
    write_questions(folder / "qa_set_more.csv", more)
    out = root / "packed"
    out.mkdir()
    assert not pack_set(NiehSet(folder), out).damaged
    return out


def placebo():
    """The same answer in both worlds; clues in no order of time."""
    named = {"pair": "swap-1/9", "fact": "swap-1/mug"}
    return [
        Question(world, "What color is it?", (4, 2), ("red", "blue"), "color", **named)
        for world in ("kitchen-1-a", "kitchen-1-b")
    ]


def of_moments(answers=("bowl", "sofa")):
    return [
        Question("kitchen-1-a", "Where is it?", (1, 2), (answer,), "a", moment=at, pair="m/1")
        for at, answer in zip((3, 7), answers, strict=True)
    ]


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Loads a task on a packed set, or on what comes with the package."""

    def load(name, data=None):
        if data:
            monkeypatch.setenv("INFTHOR_SET", str(data))
        return Task(name, tmp_path / "cache")

    return load


@pytest.mark.parametrize(
    ("task", "settings"),
    [
        (TWINS, {"more": placebo()}),
        (MOMENTS, {"twins_too": False, "more": of_moments()}),
        (TWINS, None),
    ],
    ids=("twins", "moments", "bundled"),
)
def test_the_same_replies_have_our_numbers(task, settings, load, ours, tmp_path):
    data = packed(tmp_path, **settings) if settings else None
    loaded = load(task, data)
    replies = replies_of(loaded.docs.remove_columns("clue_frames").to_list())
    data = data or packaged_folder("sets/nieh_mini_twins")
    found = {who: loaded.results(said) for who, said in replies.items()}
    assert found == {who: pytest.approx(ours(data, said)) for who, said in replies.items()}
    nets = {who: (it["net_pairs"], it["pair_accuracy"]) for who, it in found.items()}
    assert (nets["oracle"], nets["yes"]) == ((1, 1), (0, 0))
    assert nets["exchanged"] == (-1, 0)
    assert found["oracle"]["strict"] == 1


def test_requests_are_ours(load, tmp_path):
    data = packed(tmp_path, more=placebo())
    samples = find_samples({"data": str(data), "context": "clues"})
    task = load(TWINS, data)
    by_id = {sample.question.id: sample for sample in samples.samples}
    assert len(task.docs) == len(by_id) == 10
    for doc in task.docs:
        frames, text = samples.request(by_id.pop(doc["id"]))
        shown = task.config["doc_to_visual"](doc)
        assert [it.tobytes() for it in shown] == [it.load().tobytes() for it in frames]
        del doc["clue_frames"]  # which lmms-eval takes away (lmms_eval/api/task.py:1171-1185)
        assert task.config["doc_to_text"](doc) == text
        assert task.config["doc_to_target"](doc) == ", ".join(doc["answer"])


def test_clear_frames_are_shown_on_white():
    frame = Image.new("RGBA", (1, 1), (0, 0, 0, 0))
    (shown,) = docs.doc_to_visual({"gt_img_idx": [1], "clue_frames": [frame]})
    assert (shown.mode, shown.getpixel((0, 0))) == ("RGB", (255, 255, 255))


def test_each_task_takes_its_pairs_alone_one_after_the_other(load, tmp_path):
    alone = Question("kitchen-1-a", "Is it?", (1,), ("yes",), "a")
    data = packed(tmp_path, more=[*of_moments(), alone])
    moments, twins = load(MOMENTS, data).docs, load(TWINS, data).docs
    assert set(moments["pair"]) == {"m/1"}
    assert twins["pair"][::2] == twins["pair"][1::2]
    assert len(set(twins["pair"])) == 4


def test_a_pair_without_a_reply_is_left_out_and_said(load, tmp_path, caplog):
    task = load(TWINS, packed(tmp_path))
    replies = replies_of(task.docs.remove_columns("clue_frames").to_list())["oracle"]
    task.docs = task.docs.select([0, 1, 2])
    assert task.results(replies)["pair_accuracy"] == 1
    assert "1 of 2 pairs lack a reply" in caplog.text
    task.docs = task.docs.select([0])
    assert str(task.results(replies)["net_pairs"]) == "nan"


@pytest.mark.parametrize(
    ("task", "settings", "problem"),
    [
        (MOMENTS, {}, "no pairs of moments; set INFTHOR_SET"),
        (TWINS, {"twins_too": False, "more": of_moments()}, "no pairs of twins; set INFTHOR_SET"),
        (TWINS, {"more": placebo()[:1]}, "'swap-1/9' has not two questions; pack"),
        (MOMENTS, {"more": of_moments((WITHHELD, WITHHELD))}, "answers are withheld; give"),
    ],
)
def test_sets_that_cannot_be_asked_are_named(task, settings, problem, load, tmp_path):
    with pytest.raises(SystemExit, match=f"infthor-eval: .*{problem}"):
        load(task, packed(tmp_path, **settings))


def test_a_set_without_frames_is_named(load):
    with pytest.raises(SystemExit, match="questions lack clue frames; pack a set that has them"):
        load(TWINS, packaged_folder("sets/nieh_mini_long"))


def test_a_folder_that_is_no_packed_set_is_named(load, tmp_path):
    with pytest.raises(SystemExit, match=r"has no questions-.*; set INFTHOR_SET to what"):
        load(TWINS, tmp_path)


def test_moments_need_a_set(load, monkeypatch):
    monkeypatch.delenv("INFTHOR_SET", raising=False)
    with pytest.raises(SystemExit, match="no set of moments is in the package"):
        load(MOMENTS)
    with pytest.raises(AttributeError, match="no attribute 'FILES'"):
        _ = docs.FILES


@pytest.mark.skipif(
    not PACKAGES.is_dir(), reason="lmms-eval is not set aside (make test-all does it)"
)
def test_lmms_eval_itself_finds_asks_and_scores_them(load, ours, tmp_path):
    task = load(TWINS)
    rows = task.docs.remove_columns("clue_frames").to_list()
    replies = replies_of(rows)
    (tmp_path / "replies.json").write_text(json.dumps(replies))
    path = os.pathsep.join([str(PACKAGES), str(Path(__file__).parents[2])])
    home = {"HF_HOME": str(tmp_path / "hf"), "HF_HUB_OFFLINE": "1", "PYTHONPATH": path}
    words = [sys.executable, PROGRAM, tmp_path / "replies.json", tmp_path / "found.json"]
    done = subprocess.run(
        words, env={**os.environ, **home}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    found = json.loads((tmp_path / "found.json").read_text())
    data = packaged_folder("sets/nieh_mini_twins")
    assert found["asked"] == {
        row["id"]: [docs.doc_to_text(row), len(row["gt_img_idx"])] for row in rows
    }
    assert found["results"] == {
        who: pytest.approx(ours(data, said)) for who, said in replies.items()
    }
