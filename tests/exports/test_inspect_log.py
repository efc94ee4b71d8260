"""inspect_ai's logs: the documents, the frames, and what the package itself reads."""

import base64
import io
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run

from ..helpers.command_line import read_success
from .conftest import primary_metrics

# An environment of its own, as the package has eighty others behind it: `make test` makes it.
INSPECT = Path(os.environ.get("INSPECT_PYTHON", f"{sys.prefix}/inspect-ai/bin/python"))
READ = """
import json, sys
from inspect_ai.log import read_eval_log, read_eval_log_sample_summaries
for path in sys.argv[1:]:
    log = read_eval_log(path, resolve_attachments=True)
    summaries = read_eval_log_sample_summaries(path)
    print(json.dumps({
        "status": log.status,
        "model": log.eval.model,
        "means": {it.name: it.metrics["mean"].value for it in log.results.scores},
        "ids": [[it.id, it.epoch] for it in log.samples],
        "summarised": [[it.id, it.epoch] for it in summaries],
        "scores": [{n: s.value for n, s in it.scores.items()} for it in log.samples],
        "completions": [it.output.completion for it in log.samples],
        "errors": [it.error and it.error.message for it in log.samples],
        "images": [
            sum(part.type == "image" for m in it.messages if not isinstance(m.content, str)
                for part in m.content)
            for it in log.samples
        ],
        "tools": [sum(m.role == "tool" for m in it.messages) for it in log.samples],
    }))
"""


def documents(out):
    """The documents of the logs in a folder, by log and name."""
    logs = {}
    for path in sorted(out.glob("*.eval")):
        with zipfile.ZipFile(path) as archive:
            logs[path.name] = {it: json.loads(archive.read(it)) for it in archive.namelist()}
    return logs


@pytest.fixture
def only(export):
    """Exports a run of one task; returns the documents of its log."""

    def only(run, *options):
        (log,) = documents(export(run, "inspect", *options)).values()
        return log

    return only


@pytest.mark.parametrize("suite", ["nieh", "plans"])
def test_the_header_has_the_primary_metric_and_its_interval(runs, only, suite):
    header = only(runs[suite])["header.json"]
    (rate,) = primary_metrics(runs[suite]).values()
    first = header["results"]["scores"][0]
    assert first["metadata"]["is_primary"] is True
    values = {name: metric["value"] for name, metric in first["metrics"].items()}
    assert (values["mean"], values.get("ci_low"), values.get("ci_high")) == (
        rate["mean"],
        rate["low"],
        rate["high"],
    )
    assert header["status"] == "success"


def test_a_sample_has_request_reply_and_all_else(questions_run, only):
    log = only(questions_run)
    _, records = read_run(questions_run, RECORDS)
    for record in records:
        document = log[f"samples/{record.id}_epoch_{record.repeat}.json"]
        asked, replied = document["messages"]
        assert asked["content"][0]["text"].startswith("[frames: 2 to 4]")
        assert asked["content"][0]["text"].endswith(record.payload.question)
        assert replied["content"] == record.payload.reply
        assert document["scores"]["strict"]["value"] == record.payload.scores["strict"]
        assert document["metadata"]["payload"]["answers"] == list(record.payload.answers)
        assert document["attachments"] == {}
    assert len(log["summaries.json"]) == len(records)


def test_frames_are_attached_as_they_were_shown(questions_run, twin_set, only):
    log = only(questions_run, "--frames")
    data = NiehSet(twin_set)
    question = data.questions[0]
    document = log[f"samples/{question.id}_epoch_1.json"]
    images = [it["image"] for it in document["messages"][0]["content"] if it["type"] == "image"]
    shown = [data.frames(question.traj_id)[at] for at in data.clue_positions(question)]
    assert len(images) == len(shown) == 3
    for image, frame in zip(images, shown, strict=True):
        uri = document["attachments"][image.removeprefix("attachment://")]
        content = base64.b64decode(uri.removeprefix("data:image/png;base64,"))
        pixels = np.asarray(Image.open(io.BytesIO(content)).convert("RGB"))
        assert np.array_equal(pixels, np.asarray(frame.load()))


def test_frames_that_are_gone_are_named(questions_run, run_cli, tmp_path):
    words = ("--format", "inspect", "--frames", "--out", tmp_path, "--data", tmp_path)
    _, err = read_success(run_cli("export", questions_run, *words))
    assert "16 sample(s) without frames: " in err
    (log,) = documents(tmp_path).values()
    sample = log["summaries.json"][0]
    assert sample["input"] == "Where is the mug?"
    first, *_ = (content for name, content in log.items() if name.startswith("samples/"))
    (said,) = first["messages"][0]["content"]
    assert said["text"].startswith("[frames: ")  # the texts that were sent are known all the same


def test_a_failed_sample_has_its_error_and_an_excluded_one_is_none(arm_run, export):
    logs = documents(export(arm_run, "inspect"))
    (pickups,) = (log for name, log in logs.items() if "arm_pickup" in name)
    assert pickups["header.json"]["status"] == "cancelled"  # it is not known whether all is done
    assert pickups["header.json"]["results"]["completed_samples"] == 1
    document = pickups["samples/c/0002_epoch_1.json"]
    assert document["error"]["message"] == "the policy says nan; fix it"
    assert document["scores"] == {}
    about = pickups["header.json"]["eval"]["metadata"]
    assert about["excluded_by_reason"] == {"the object is out of reach": 1}
    assert "samples/c/0004_epoch_1.json" not in pickups


@pytest.mark.skipif(not INSPECT.is_file(), reason="inspect_ai is not set aside (make test does it)")
@pytest.mark.parametrize("suite", ["nieh", "plans", "manipulation"])
def test_the_package_reads_the_log(runs, export, suite):
    out = export(runs[suite], "inspect", "--frames")
    paths = sorted(map(str, out.glob("*.eval")))
    done = subprocess.run(
        [INSPECT, "-c", READ, *paths], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    logs = documents(out).values()
    for line, log in zip(done.stdout.splitlines(), logs, strict=True):
        read = json.loads(line)
        samples = [it for name, it in log.items() if name.startswith("samples/")]
        by_id = {(it["id"], it["epoch"]): it for it in samples}
        assert read["status"] == log["header.json"]["status"]
        assert sorted(read["summarised"]) == sorted(read["ids"])
        assert {tuple(it) for it in read["ids"]} == set(by_id)
        for at, key in enumerate(map(tuple, read["ids"])):
            ours = by_id[key]["scores"]
            assert read["scores"][at] == {name: it["value"] for name, it in ours.items()}
            assert read["errors"][at] == by_id[key].get("error", {}).get("message")
        if suite == "nieh":
            assert set(read["images"]) == {3}
            assert all(read["completions"])
        else:
            assert sum(read["tools"]) > 0 or suite == "manipulation"
