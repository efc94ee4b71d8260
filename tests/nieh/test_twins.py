"""Twins as a task: pairs that are asked together, in the context that a run names."""

import json

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.harness.nieh_task import net_pairs, pair_accuracy, pairs_exchanged, process_pair
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.twins import first_world, twin_side
from infthor_eval.runs import read_run

from ..helpers.command_line import assert_refused, option_words, read_success
from ..helpers.twin_sets import CLUES, DIFFERING, write_twin_set


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
    for model, expected in (("oracle", 1.0), ("blind", 0.0)):
        out = tmp_path / model
        words = option_words(model=model, tasks="nieh_twins", data=twins, out=out)
        printed, _ = read_success(run_cli(*words))
        assert "Twins: net pairs, %" in printed
        found = results(out)
        assert found["primary_metrics"]["nieh_twins"]["mean"] == expected
        assert found["summary"]["tasks"]["nieh_twins"]["pairs"]["net_pairs"]["mean"] == expected
        assert found["summary"]["tasks"]["nieh_twins"]["pairs"]["n_trajectories"] == 2


@pytest.mark.parametrize("context", ["clues", "trajectory"])
def test_of_two_worlds_the_one_that_is_drawn_is_asked_about_first(
    twins, tmp_path, run_cli, context
):
    words = ("--tasks", "nieh_twins", "--data", twins, "--context", context)
    assert run_cli("run", "--model", "flip", *words, "--output", tmp_path)[0] == 0
    (journal,) = tmp_path.rglob("worker-*.jsonl")
    asked = {}
    for line in journal.read_text().splitlines():
        payload = json.loads(line).get("payload", {})
        if "twin" in payload:
            asked.setdefault(payload["twin"]["pair"], []).append(payload)
    assert len(asked) == 4
    for first, second in asked.values():
        worlds = [payload["twin"]["traj_id"] for payload in (first, second)]
        assert worlds[0] == first_world(worlds)
        assert first["reply"] != second["reply"]


def test_the_world_that_comes_first_is_drawn():
    pairs = [(f"{number:x}", f"{number + 1:x}") for number in range(0, 2000, 2)]
    assert 450 < sum(first_world(pair) == pair[0] for pair in pairs) < 550
    assert all(first_world(pair) == first_world(pair[::-1]) for pair in pairs)


def test_hash_says_the_same_where_the_frames_are_the_same(twins, tmp_path, run_cli):
    words = ("run", "--model", "hash", "--tasks", "nieh_twins", "--data", twins)
    assert run_cli(*words, "--controls", "--output", tmp_path)[0] == 0
    flipped = {}
    for file in tmp_path.rglob("results.json"):
        found = json.loads(file.read_text())
        pairs = found["summary"]["tasks"]["nieh_twins"]["pairs"]
        flipped[found["config"]["frames"]] = pairs["flipped"]["mean"]
    assert flipped["other"] == flipped["blank"] == 0.0 < flipped["shown"]


def test_a_metric_of_ones_own_scores_the_reply_in_the_other_world_too(
    twins, tmp_path, run_cli, task_files
):
    (task_files / "nieh" / "own.py").write_text(
        "import json\n\n"
        "def measure(doc, results):\n"
        "    return {'begins': float(results[0][:2] in doc['answers'])}\n"
    )
    (task_files / "nieh" / "own_twins.yaml").write_text(
        "include: _nieh.yaml\ntask: own_twins\ndataset_kwargs: {context: clues}\n"
        "process_results: !function own.measure\nmetric_list: [{metric: begins}]\n"
    )
    words = ("run", "--model", "flip", "--tasks", "own_twins", "--data", twins)
    read_success(run_cli(*words, "--output", tmp_path / "out"))
    pairs = results(tmp_path / "out")["summary"]["tasks"]["own_twins"]["pairs"]
    (folder,) = (path.parent for path in tmp_path.rglob("results.json"))
    for side in (record.payload for record in read_run(folder, RECORDS)[1]):
        elsewhere = side.reply[:2] in json.dumps(side.twin.answers)
        assert side.twin.scores == {"begins": float(elsewhere)}
    assert pairs["net_pairs"]["mean"] == pytest.approx(
        pairs["pair_accuracy"]["mean"] - pairs["pairs_exchanged"]["mean"]
    )


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
    assert_refused(run_cli(*words, *options), problem)


def test_a_set_without_its_pairs_is_named(twins, tmp_path, run_cli):
    (tmp_path / "qa_set_twins.csv").write_bytes((twins / "qa_set_twins.csv").read_bytes())
    words = ("run", "--model", "oracle", "--tasks", "nieh_twins", "--out", tmp_path / "out")
    assert_refused(run_cli(*words, "--data", tmp_path), "twins.jsonl", after_notes=True)


def test_the_metrics_of_lm_eval_are_the_same(twins):
    data = NiehSet(twins)
    answers = {(it.pair, it.traj_id): it.answers for it in data.questions}
    sides = []
    for question in data.questions:
        doc = {
            "answers": json.dumps(question.answers),
            "pair": question.pair,
            "variant": "",
        }
        (other,) = (
            answer
            for (pair, traj_id), answer in answers.items()
            if pair == question.pair and traj_id != question.traj_id
        )
        said = {"swap-1/1": question.answers[0], "swap-1/2": other[0]}
        sides.append(process_pair(doc, [said.get(question.pair, "bowl")])["net_pairs"])
    assert pair_accuracy(sides) == pairs_exchanged(sides) == 1 / 4
    assert net_pairs(sides) == 0.0
    assert net_pairs(sides[:1]) == pair_accuracy(sides[:1]) == 0.0
