"""Finished runs are sent to trackers and to the hub with arguments that these take."""

import json
import sys
from pathlib import Path
from unittest.mock import create_autospec

import pytest
from huggingface_hub import HfApi

from ..helpers.command_line import assert_refused, option_words
from . import tracker_doubles


@pytest.fixture
def run_words(make_nieh_set, tmp_path):
    """The words of a run of five questions."""
    return option_words(
        model="oracle", tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path / "out"
    )


@pytest.fixture
def doubled(monkeypatch):
    """Installs the double of a package, or takes the package away."""

    def doubled(package, is_installed=True):
        modules, double = getattr(tracker_doubles, package)()
        for name, module in modules.items():
            monkeypatch.setitem(sys.modules, name, module)
        if not is_installed:
            monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
        return double

    return doubled


@pytest.fixture
def hub(monkeypatch):
    """The hub's client, whose calls are held to the real one's signatures; nothing is sent."""
    api = create_autospec(HfApi, instance=True)
    monkeypatch.setattr("huggingface_hub.HfApi", lambda token: api)
    monkeypatch.setattr(
        "lm_eval.loggers.EvaluationTracker.recreate_metadata_card", lambda self: api.card()
    )
    api.card = lambda: None
    monkeypatch.setenv("HF_TOKEN", "hf_of_nobody")
    return api


def test_wandb_is_given_metrics_configuration_and_samples(run_words, run_cli, doubled):
    double = doubled("wandb")
    code, _, err = run_cli(*run_words, "--wandb-args", "project=mine,mode=offline")
    assert code == 0, err
    assert double.of("init") == [{"name": "oracle", "project": "mine", "mode": "offline"}]
    assert {"nieh_gt/strict": 1.0, "nieh_gt/reference": 1.0}.items() <= double.of("log")[0][
        "data"
    ].items()
    (configuration, *_) = double.of("update")
    assert configuration["cli_configs"]["model_args"] == {"adapter": "oracle"}
    table = double.of("log")[-1]["data"]["nieh_gt_eval_results"]
    assert list(table["labels"])[1] == "CounterTop"
    assert len(table) == 5
    assert [call["name"] for call in double.of("Artifact")] == ["results", "nieh_gt"]
    assert double.of("finish") == [{}]


def test_trackio_is_given_metrics_and_a_trace_of_each_sample(run_words, run_cli, doubled):
    double = doubled("trackio")
    assert (
        run_cli(*run_words, "--trackio-args", "project=mine,name=first,auto_log_gpu=False")[0] == 0
    )
    assert double.of("init") == [{"name": "first", "project": "mine", "auto_log_gpu": False}]
    assert double.of("log")[0]["metrics"]["nieh_gt/strict"] == 1.0
    traces = double.of("Trace")
    assert len(traces) == 5
    assert {trace["metadata"]["strict"] for trace in traces} == {1.0}
    assert "Is there a mug?" in traces[0]["messages"][0]["content"]
    assert double.of("finish") == [{}]


def test_each_run_of_a_command_is_sent_by_its_name_once_it_is_finished(run_words, run_cli, doubled):
    double = doubled("trackio")
    run_words[1] = "oracle,blind"
    assert run_cli(*run_words, "--trackio-args", "project=mine")[0] == 0
    assert [call["name"] for call in double.of("init")] == ["oracle", "blind"]


def test_the_hub_is_given_results_and_samples(run_words, run_cli, hub, tmp_path):
    where = "hub_results_org=us,details_repo_name=runs"
    pushed = f"{where},push_results_to_hub=True,push_samples_to_hub=True"
    files = {}
    hub.upload_folder.side_effect = lambda **call: files.update(read(call["folder_path"]))
    code, _, err = run_cli(*run_words, "--hf-hub-log-args", pushed)
    assert code == 0, err
    (sent,) = hub.upload_file.call_args_list
    assert (sent.kwargs["repo_id"], sent.kwargs["repo_type"]) == ("us/runs-private", "dataset")
    assert sent.kwargs["path_in_repo"].startswith("oracle/results_")
    (lines,) = [text for name, text in files.items() if name.startswith("samples_nieh_gt")]
    rows = [json.loads(line) for line in lines.splitlines()]
    (ours,) = (tmp_path / "out").rglob("samples_nieh_gt*.jsonl")
    theirs = [json.loads(line) for line in ours.read_text().splitlines()]
    assert [row["doc_hash"] for row in rows] == [row["doc_hash"] for row in theirs]


def read(folder):
    return {path.name: path.read_text() for path in Path(folder).iterdir()}


def test_what_a_tracker_does_not_take_is_told_and_the_run_is_whole(
    run_words, run_cli, hub, tmp_path
):
    hub.upload_file.side_effect = OSError("the network is down")
    code, out, err = run_cli(
        *run_words, "--hf-hub-log-args", "hub_results_org=us,push_results_to_hub=True"
    )
    assert code == 1
    assert "oracle" in out
    notes = " ".join(err.split())
    assert (
        "could not be sent to the hub (Could not save results aggregated OSError('the network is "
        "down'))" in notes
    )
    assert "run the same command again" in notes
    assert "hf_of_nobody" not in out + err
    assert len(list((tmp_path / "out").rglob("results.json"))) == 1
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--wandb-args", "projct=mine", "--wandb-args has no projct; did you mean project?"),
        ("--wandb-args", "mine", "--wandb-args: 'mine' is not of the form key=value"),
        ("--trackio-args", "entity=x", "--trackio-args has no entity; there are ['project'"),
        (
            "--hf-hub-log-args",
            "hub_results_org=us",
            "--hf-hub-log-args would push nothing; add push_results_to_hub",
        ),
        ("--hf-hub-log-args", "token=secret", "--hf-hub-log-args has no token"),
        (
            "--hf-hub-log-args",
            "push_results_to_hub=True",
            "--hf-hub-log-args needs a token of the hub; set HF_TOKEN",
        ),
    ],
)
def test_what_cannot_be_sent_is_refused_before_anything_is_asked(
    run_words, run_cli, doubled, monkeypatch, tmp_path, option, value, expected
):
    monkeypatch.delenv("HF_TOKEN", raising=False)
    monkeypatch.setattr("huggingface_hub.get_token", lambda: None)
    doubled("wandb")
    doubled("trackio")
    assert_refused(run_cli(*run_words, option, value), expected)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("package", ["wandb", "trackio"])
def test_a_package_that_is_missing_is_named_with_the_mend(run_words, run_cli, doubled, package):
    doubled(package, is_installed=False)
    code, _, err = run_cli(*run_words, f"--{package}-args", "project=mine")
    assert code == 2
    assert (
        err.splitlines()[-1]
        == f"infthor-eval: --{package}-args needs the package {package}; pip install {package}"
    )


@pytest.mark.parametrize(
    ("package", "more"), [("wandb", "mode=offline"), ("trackio", "auto_log_gpu=False")]
)
def test_the_real_package_takes_a_run(run_words, run_cli, tmp_path, monkeypatch, package, more):
    pytest.importorskip(package)
    monkeypatch.setenv("WANDB_DIR", str(tmp_path))
    monkeypatch.setenv("TRACKIO_DIR", str(tmp_path))
    code, _, err = run_cli(*run_words, f"--{package}-args", f"project=mine,{more}")
    assert code == 0, err
