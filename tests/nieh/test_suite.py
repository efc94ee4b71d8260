"""Runs of NIEH from the request to the results."""

import itertools
import json
from collections import Counter

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh import samples
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.results.evidence_tables import above_blind_notes
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import execute, prepare_all, read_run

from ..helpers.questions import make_question
from .watching import Watcher, replies

TINY = "qwen2.5-vl-tiny"


def cells(outcome):
    return {name: task.by_clues for name, task in outcome.summary.summary.tasks.items()}


def test_oracle_is_right_everywhere(prepare_run):
    outcome = execute(prepare_run())
    assert Counter(record.task for record in outcome.records) == {"nieh_gt": 5, "nieh_full": 5}
    assert all(
        record.payload.reply == ", ".join(map(str, record.payload.answers))
        for record in outcome.records
    )


def test_blind_with_one_trajectory_is_said_to_be_no_measure_and_nothing_is_above_it(
    make_nieh_set, prepare_run
):
    alone = make_nieh_set(
        [make_question(text="Is there a mug?"), make_question(text="Is there a pan?")], name="alone"
    )
    watcher = Watcher()
    outcome = execute(prepare_run(model="blind", data=alone, tasks=("nieh_gt",)), watcher)
    assert [cost.description.partition(":")[0] for cost in watcher.work.costs] == ["one trajectory"]
    assert {record.payload.reply for record in outcome.records} == {"yes"}
    assert {record.payload.blind for record in outcome.records} == {None}
    (note,) = above_blind_notes([outcome.summary])
    assert (
        note == "above blind: not given, as beside one trajectory there is no other to learn from."
    )


def test_runs_of_one_command_read_a_set_once_and_the_next_command_anew(data, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr(samples, "NiehSet", lambda *where: opened.append(where) or NiehSet(*where))
    models = (ModelSpec("oracle", {}), ModelSpec("blind", {}))
    for n_opened in (1, 2):
        options = RunOptions(models, tasks=("nieh",), data=data, output=tmp_path)
        assert len(prepare_all(options.requests())) == 2
        assert len(opened) == n_opened


def test_the_same_command_goes_on_and_another_starts_anew(prepare_run):
    watchers = Watcher(), Watcher()
    first, again = (execute(prepare_run(), watcher) for watcher in watchers)
    done = [(len(watcher.evaluated), len(watcher.resumed)) for watcher in watchers]
    assert done == [(10, 0), (0, 10)]
    assert (again.folder, again.summary) == (first.folder, first.summary)
    assert again.records == first.records
    for changes in ({"seed": 1}, {"limit": 1}, {"tasks": ("nieh_gt",)}, {"model": "blind"}):
        assert execute(prepare_run(**changes)).folder != first.folder
    assert read_run(first.folder, RECORDS) == (first.summary.header, first.records)


def test_the_results_file_says_what_the_summary_says(prepare_run):
    outcome = execute(prepare_run(name="mine"))
    document = json.loads((outcome.folder / "results.json").read_text())
    assert outcome.folder.parent.name == "mine"
    assert set(document) == {
        *("suite", "name", "config", "n_missing", "units", "primary_metrics", "summary", "usage")
    }
    assert (document["suite"], document["name"]) == ("nieh", "mine")
    assert document["config"] == outcome.summary.header.config.document
    strict = document["summary"]["tasks"]["nieh_gt"]["by_clues"]["total"]["scores"]["strict"]
    assert strict.keys() == {"mean", "stderr", "low", "high", "bootstrap", "n_trajectories"}
    assert (
        strict["mean"]
        == outcome.summary.summary.tasks["nieh_gt"].by_clues["total"].scores["strict"].mean
        == 1.0
    )


def test_a_changed_frame_of_the_same_size_is_noticed(prepare_run, data):
    execute(prepare_run(tasks=("nieh_gt",)))
    frame = data / "metadata" / "traj_a" / "img" / "000000001.png"
    content = bytearray(frame.read_bytes())
    content[-20] ^= 1
    frame.write_bytes(bytes(content))
    watcher = Watcher()
    execute(prepare_run(tasks=("nieh_gt",)), watcher)
    evaluated = {record.payload.question for record in watcher.evaluated}
    assert evaluated == {"Is there a mug?", "Where was the mug before you put it?"}
    assert {record.attempt for record in watcher.evaluated} == {2}


def test_a_frame_that_is_no_image_has_the_samples_that_need_it_skipped(prepare_run, data):
    (data / "metadata" / "traj_b" / "img" / "000000002.png").write_text("text")
    outcome = execute(prepare_run())
    assert {name: task.skipped.n for name, task in outcome.summary.summary.tasks.items()} == {
        "nieh_gt": 1,
        "nieh_full": 2,
    }


def test_the_tiny_model_runs_through_and_shares_prefixes(prepare_run):
    watcher = Watcher()
    execute(prepare_run(TINY, tasks=("nieh_full",)), watcher)
    assert all(record.payload.reply is not None for record in watcher.evaluated)
    by_trajectory = {}
    for record in watcher.evaluated:  # in the order of asking
        by_trajectory.setdefault(record.cluster, []).append(record.tokens.cached)
    assert {traj_id: len(cached) for traj_id, cached in by_trajectory.items()} == {
        "traj_a": 3,
        "traj_b": 2,
    }
    assert all(cached[0] < min(cached[1:]) for cached in by_trajectory.values())


def test_the_limit_is_of_questions_that_can_be_asked_with_all_their_variants(make_nieh_set):
    inside = [
        Question("t", f"Is there a mug on {step}?", (step,), ("yes",)) for step in (14, 15, 16, 17)
    ]
    outside = [
        Question("t", f"Is there a cup on {step}?", (step,), ("yes",)) for step in (90, 91, 92)
    ]
    questions = [outside[0], inside[0], inside[1], outside[1], inside[2], outside[2], inside[3]]
    root = make_nieh_set(questions, n_frames=30, size=56)
    config = {"context": "haystack", "data": str(root), "ctx_size": 10, "tokens_per_frame": 1000}

    def take(limit):
        samples = find_samples(config, limit)
        return (
            [sample.question.text[-2:-1] for sample in samples.samples],
            [skipped.question.text for skipped in samples.skipped],
        )

    taken = [take(limit) for limit in (1, 2, 3, 4, 9, None)]
    for limit, (steps, _) in enumerate(taken[:4], 1):
        assert steps == [digit for digit in sorted(set(steps)) for _ in range(5)]
        assert len(set(steps)) == limit
    for (few, few_left_out), (more, more_left_out) in itertools.pairwise(taken):
        assert set(few) <= set(more)
        assert set(few_left_out) <= set(more_left_out)
    assert (
        taken[-1]
        == taken[-2]
        == ([digit for digit in "4567" for _ in range(5)], [question.text for question in outside])
    )


def test_the_limit_takes_from_all_trajectories(make_nieh_set):
    questions = [
        Question(t, f"Is there a mug {n}?", (1,), ("yes",))
        for t in ("a", "b", "c")
        for n in range(9)
    ]
    root = make_nieh_set(questions, size=56)
    samples = [
        find_samples({"context": "clues", "data": str(root), "seed": seed}, 4).samples
        for seed in (0, 0, 1)
    ]
    assert {sample.question.traj_id for sample in samples[0]} == {"a", "b", "c"}
    assert samples[0] == samples[1] != samples[2]


def test_baselines_answer_the_same_whatever_runs_beside_them(
    prepare_run, make_nieh_set, task_files
):
    """Two tasks on sets with other answer keys: what one asks is no clue to another."""
    key = {"one": ("yes", "yes", "no"), "two": ("no", "no", "yes")}
    for name, answers in key.items():
        root = make_nieh_set(
            [
                Question(f"t{i}", f"Is there a {name} {i}?", (i,), (answer,))
                for i, answer in enumerate(answers)
            ],
            size=56,
            name=name,
        )
        (task_files / "nieh" / f"nieh_{name}.yaml").write_text(
            "include: _nieh.yaml\n"
            f"task: nieh_{name}\n"
            f"dataset_kwargs: {{context: clues, data: {root}}}\n"
        )
    for model in ("blind", "random"):
        alone = [execute(prepare_run(model, tasks=(f"nieh_{name}",))) for name in key]
        together = execute(prepare_run(model, tasks=("nieh_one", "nieh_two")))
        assert replies(together) == replies(alone[0]) | replies(alone[1])
        assert cells(together) == cells(alone[0]) | cells(alone[1])


def test_a_baseline_reads_the_whole_key_whatever_is_asked_of_it(prepare_run):
    for model in ("blind", "random"):
        whole, few = (replies(execute(prepare_run(model, limit=limit))) for limit in (None, 2))
        assert len(few) == 4
        assert few.items() <= whole.items()
