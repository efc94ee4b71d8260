"""Every Eval Ever: by its schemas, by the rules of its validator, and number by number."""

import hashlib
import json
import math
import re

import jsonschema
import pytest

from infthor_eval.runs.journals.shards import find_shards

from ..helpers.command_line import assert_refused, read_success
from .conftest import SCHEMAS, primary_metrics

SUITES = ("nieh", "plans", "manipulation")
AGGREGATE = re.compile(
    r"data/[\w.@+-]+/[\w.@+-]+/[\w.@+-]+/"
    r"[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}\.json"
)


def read(out):
    """The one aggregate below a folder with its path there, and the lines of its samples."""
    (path,) = out.rglob("*.json")
    lines = path.with_name(f"{path.stem}_samples.jsonl").read_text().splitlines()
    return path.relative_to(out), json.loads(path.read_text()), [json.loads(it) for it in lines]


def results_of(aggregate):
    return {it["evaluation_result_id"]: it for it in aggregate["evaluation_results"]}


@pytest.mark.skipif(not SCHEMAS.is_dir(), reason="the schemas are not at ../shared/data")
@pytest.mark.parametrize("suite", SUITES)
def test_the_schemas_take_all_lines(runs, export, suite):
    _, aggregate, rows = read(export(runs[suite], "every-eval-ever"))
    schemas = [
        json.loads((SCHEMAS / f"{name}.schema.json").read_text())
        for name in ("eval", "instance_level_eval")
    ]
    assert [schema["version"] for schema in schemas] == [aggregate["schema_version"]] * 2
    whole, line = map(jsonschema.Draft7Validator, schemas)
    problems = [error.message for error in whole.iter_errors(aggregate)]
    problems += [error.message for row in rows for error in line.iter_errors(row)]
    assert problems == []


@pytest.mark.parametrize("suite", SUITES)
def test_the_rules_of_its_validator(runs, export, suite):
    """Paths, the pair of files, bounds, model fields: what its schemas do not say."""
    out = export(runs[suite], "every-eval-ever")
    path, aggregate, rows = read(out)
    assert AGGREGATE.fullmatch(path.as_posix())
    samples = aggregate["detailed_evaluation_results"]
    assert samples["file_path"] == str(path.with_name(f"{path.stem}_samples.jsonl"))
    content = (out / samples["file_path"]).read_bytes()
    assert samples["checksum"] == hashlib.sha256(content).hexdigest()
    assert samples["total_rows"] == len(rows) > 0
    assert {row["evaluation_id"] for row in rows} == {aggregate["evaluation_id"]}
    assert {row["model_id"] for row in rows} == {aggregate["model_info"]["id"]}
    for result in aggregate["evaluation_results"]:
        config, score = result["metric_config"], result["score_details"]["score"]
        low, high = (float(config[name]) for name in ("min_score", "max_score"))
        assert low <= score <= high
        assert math.isfinite(score)
    for row in rows:
        is_single = row["interaction_type"] == "single_turn"
        assert (row["output"] is None, row["messages"] is None) == (not is_single, is_single)
        assert all(isinstance(value, str) for value in row["metadata"].values())


@pytest.mark.parametrize("suite", ["nieh", "plans"])
def test_the_primary_metric_is_that_of_the_results(runs, export, suite):
    _, aggregate, _ = read(export(runs[suite], "every-eval-ever"))
    found = {}
    for result in aggregate["evaluation_results"]:
        details = result["score_details"]
        if details["details"]["is_primary"] == "true":
            interval = details["uncertainty"].get("confidence_interval", {})
            found[result["evaluation_name"]] = {
                "mean": details["score"],
                "low": interval.get("lower"),
                "high": interval.get("upper"),
                "n": details["uncertainty"]["num_samples"],
            }
    assert found == primary_metrics(runs[suite])


@pytest.mark.parametrize("suite", SUITES)
def test_the_mean_of_the_samples_is_the_score(runs, export, suite):
    _, aggregate, rows = read(export(runs[suite], "every-eval-ever"))
    for name, result in results_of(aggregate).items():
        of_metric = (row for row in rows if row["evaluation_result_id"] == name)
        scores = [row["evaluation"]["score"] for row in of_metric if not row.get("error")]
        assert sum(scores) / len(scores) == pytest.approx(result["score_details"]["score"])


def test_numbers_of_the_summary_and_their_intervals(questions_run, export):
    _, aggregate, _ = read(export(questions_run, "every-eval-ever"))
    results = results_of(aggregate)
    assert list(results)[:3] == [
        f"nieh_gt/{name}" for name in ("net_pairs", "pair_accuracy", "pairs_exchanged")
    ]
    summary = json.loads((questions_run / "results.json").read_text())["summary"]["tasks"]
    for name in ("net_pairs", "pair_accuracy", "pairs_exchanged"):
        told = results[f"nieh_gt/{name}"]["score_details"]
        assert told["score"] == pytest.approx(summary["nieh_gt"]["pairs"][name]["mean"])
    config = results["nieh_gt/net_pairs"]["metric_config"]
    assert (config["min_score"], config["max_score"]) == (-1.0, 1.0)
    scored = {
        "nieh_gt/strict": summary["nieh_gt"]["by_clues"]["total"]["scores"]["strict"],
        # Without ends where all trajectories have the same mean.
        "nieh_gt/strict, above blind": summary["nieh_gt"]["above_blind"]["strict"],
    }
    for name, rate in scored.items():
        details = results[name]["score_details"]
        interval = details["uncertainty"].get("confidence_interval", {})
        found = (details["score"], interval.get("lower"), interval.get("upper"))
        assert found == (rate["mean"], rate["low"], rate["high"])
    config = results["nieh_gt/reference"]["metric_config"]
    assert (config["min_score"], config["max_score"]) == (0.0, "Infinity")


def test_a_line_has_request_reply_and_all_else(questions_run, export):
    _, _, rows = read(export(questions_run, "every-eval-ever"))
    strict = [row for row in rows if row["evaluation_result_id"] == "nieh_gt/strict"]
    assert len(strict) == 16  # eight questions, twice
    row = strict[0]
    assert row["input"]["formatted"].startswith("<image><image><image>")
    assert row["input"]["formatted"].endswith(row["input"]["raw"])
    assert row["metadata"]["frames"] == "2-4"
    payload = json.loads(row["metadata"]["payload"])
    assert (payload["reply"], ", ".join(payload["answers"])) == (
        row["output"]["raw"][0],
        row["input"]["reference"][0],
    )
    pair = next(row for row in rows if row["evaluation_result_id"] == "nieh_gt/net_pairs")
    assert len(json.loads(pair["metadata"]["members"])) == len(pair["output"]["raw"]) == 4


def test_an_episode_is_its_steps(scripted_run, export):
    _, _, rows = read(export(scripted_run, "every-eval-ever"))
    row = next(row for row in rows if row["evaluation"]["num_turns"])
    payload = json.loads(row["metadata"]["payload"])
    calls = [it["tool_calls"][0] for it in row["messages"] if it["role"] == "assistant"]
    assert len(calls) == len(payload["steps"]) == row["evaluation"]["num_turns"]
    assert row["messages"][0]["content"] == f"{payload['goal']}\n{payload['plan']}"
    assert [it["turn_idx"] for it in row["messages"]] == list(range(len(row["messages"])))


def test_what_is_left_out_is_said_with_its_reason(arm_run, run_cli, tmp_path):
    words = ("--format", "every-eval-ever", "--out", tmp_path)
    _, err = read_success(run_cli("export", arm_run, *words))
    assert "arm_pickup: it is not known whether all of the run is done; 1 of 2 failed" in err
    _, aggregate, rows = read(tmp_path)
    details = results_of(aggregate)["arm_pickup/success"]["score_details"]["details"]
    assert details["is_whole"] == "false"
    assert json.loads(details["failed_by_reason"]) == {"the policy says nan; fix it": 1}
    assert json.loads(details["excluded_by_reason"]) == {"the object is out of reach": 1}
    (failed,) = (row for row in rows if row["error"])
    assert failed["error"] == "the policy says nan; fix it"
    assert results_of(aggregate)["arm_pickup/success"]["score_details"]["score"] == 1.0
    assert not any(row["sample_id"] == "c/0004" for row in rows)


def test_a_stopped_run_says_how_much_is_missing(questions_run, tmp_path, run_cli):
    import shutil

    run = tmp_path / "stopped"
    shutil.copytree(questions_run, run)
    (shard,) = find_shards(run)
    lines = shard.read_bytes().splitlines(keepends=True)
    units = [line for line in lines if b'"type":"unit"' in line]
    shard.write_bytes(b"".join(lines[: lines.index(units[9])]))
    results = json.loads((run / "results.json").read_text())
    (run / "results.json").write_text(json.dumps(results | {"n_missing": 7}))
    code, _, err = run_cli("export", run, "--format", "every-eval-ever", "--out", tmp_path / "out")
    assert (code, "7 of the run's units not done" in err) == (0, True)
    _, aggregate, _ = read(tmp_path / "out")
    details = results_of(aggregate)["nieh_gt/strict"]["score_details"]["details"]
    assert (details["is_whole"], details["n_not_attempted"]) == ("false", "7")


def test_exported_again_it_replaces_its_files(questions_run, export):
    first, *_ = read(export(questions_run, "every-eval-ever"))
    second, *_ = read(export(questions_run, "every-eval-ever"))
    assert first == second


def test_the_model_as_others_know_it(questions_run, export):
    words = ("--model-id", "org/some-model", "--organization", "we", "--dataset", "me/set")
    path, aggregate, _ = read(export(questions_run, "every-eval-ever", *words))
    assert path.parts[2:4] == ("org", "some-model")
    assert aggregate["model_info"]["developer"] == "org"
    assert aggregate["source_metadata"]["source_organization_name"] == "we"
    assert aggregate["evaluation_results"][0]["source_data"]["hf_repo"] == "me/set"


def test_runs_of_two_models_have_no_one_name(questions_run, arm_run, run_cli, tmp_path):
    words = ("--format", "every-eval-ever", "--out", tmp_path, "--model-id", "a/b")
    assert_refused(
        run_cli("export", questions_run, arm_run, *words),
        "--model-id: names one model, and arms is another than random",
    )
