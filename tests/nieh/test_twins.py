"""Twins as a task: pairs that are asked together, in the context that a run names."""

import json

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.harness.nieh_task import pair_accuracy, process_pair
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.twins import twin_side

from ..helpers.command_line import run_cli
from ..helpers.twin_sets import CLUES, DIFFERING, write_twin_set

__all__ = ["run_cli"]


@pytest.fixture(scope="module")
def twins(tmp_path_factory):
    return write_twin_set(tmp_path_factory.mktemp("twins") / "set")


def results(folder):
    (file,) = folder.rglob("results.json")
    return json.loads(file.read_text())


def test_both_questions_of_a_pair_have_one_base_and_the_same_clues(twins):
    for sample in find_samples({"data": str(twins)}).samples:
        question = sample.question
        assert question.cluster.startswith("base of swap-")
        assert question.draw_name == question.pair
        assert sample.frames == CLUES


def test_a_limit_takes_whole_pairs(twins):
    for limit in (1, 2, 3):
        pairs = [it.question.pair for it in find_samples({"data": str(twins)}, limit).samples]
        assert len(pairs) == limit + limit % 2
        assert sorted(pairs) == sorted(2 * list(set(pairs)))


def test_a_record_says_what_differs_among_the_shown_frames(twins):
    samples = find_samples({"data": str(twins), "context": "trajectory"})
    for sample in samples.samples:
        side = twin_side(samples, sample)
        assert (side.n_frames, side.n_differing) == (8, len(DIFFERING))
        assert side.n_after_clues == 8 - 1 - max(CLUES)
        assert side.answers != sample.question.answers
        assert side.kind == "swap"


def test_windows_are_the_same_in_both_worlds(twins):
    config = {"data": str(twins), "context": "haystack", "ctx_size": 0.004, "tokens_per_frame": 1}
    windows = {}
    for sample in find_samples(config).samples:
        windows.setdefault((sample.question.pair, sample.variant), []).append(sample.frames)
    assert windows
    assert all(first == second for first, second in windows.values())


def test_the_oracle_has_all_pairs_and_blind_none(twins, tmp_path, run_cli):
    for model, expected in (("oracle", 1.0), ("blind", 0.0), ("blind-count", 0.0)):
        out = tmp_path / model
        code, printed, _ = run_cli(
            "run", "--model", model, "--tasks", "nieh_twins", "--data", twins, "--out", out
        )
        assert code == 0
        assert "Twins: pairs right, %" in printed
        found = results(out)
        assert found["primary_metrics"]["nieh_twins"]["mean"] == expected
        assert found["summary"]["tasks"]["nieh_twins"]["pairs"]["pair_accuracy"]["mean"] == expected
        assert found["summary"]["tasks"]["nieh_twins"]["pairs"]["n_trajectories"] == 2


def test_a_run_with_each_context(twins, tmp_path, run_cli):
    words = ("run", "--model", "oracle", "--tasks", "nieh_twins", "--data", twins)
    code, _, _ = run_cli(*words, "--context", "clues,trajectory", "--out", tmp_path)
    contexts = [
        json.loads(file.read_text())["summary"]["tasks"]["nieh_twins"]["context"]
        for file in tmp_path.rglob("results.json")
    ]
    assert (code, sorted(contexts)) == (0, ["clues", "trajectory"])


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--tasks", "nieh_gt", "--context", "clues"), "leaves its context open"),
        (("--tasks", "nieh_twins", "--context", "clue"), "clues"),
        (("--tasks", "nieh_twins", "--context", "haystack"), "--ctx-size"),
    ],
)
def test_contexts_that_cannot_be(twins, tmp_path, run_cli, options, problem):
    words = ("run", "--model", "oracle", "--data", twins, "--out", tmp_path)
    code, _, err = run_cli(*words, *options)
    assert code == 2
    assert problem in err
    assert len(err.strip().splitlines()) == 1


def test_a_set_without_its_pairs_is_named(twins, tmp_path, run_cli):
    (tmp_path / "qa_set_twins.csv").write_bytes((twins / "qa_set_twins.csv").read_bytes())
    words = ("run", "--model", "oracle", "--tasks", "nieh_twins", "--out", tmp_path / "out")
    code, _, err = run_cli(*words, "--data", tmp_path)
    assert code == 2
    assert "twins.jsonl" in err


def test_the_metric_of_lm_eval_is_the_same(twins):
    data = NiehSet(twins)
    sides = []
    for question in data.questions:
        doc = {
            "answers": json.dumps(question.answers),
            "pair": question.pair,
            "variant": "",
        }
        reply = question.answers[0] if question.pair == "swap-1/1" else "bowl"
        sides.append(process_pair(doc, [reply])["pair_accuracy"])
    assert pair_accuracy(sides) == 1 / 4
    assert pair_accuracy(sides[:1]) == 0.0
