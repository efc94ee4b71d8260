"""The task files under plain lm-eval, with its own multimodal model and nothing of ours but the files."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.runs import RunRequest, execute, plan

PEERS = Path(sys.prefix) / "test-peers"
SHIM = Path(__file__).parents[1] / "peers"


def replies(folder):
    found = {}
    for path in folder.rglob("samples_*.jsonl"):
        for line in path.read_text().splitlines():
            sample = json.loads(line)
            found[path.name.split("_2")[0], sample["doc"]["question_id"]] = sample["resps"][0][0]
    return found


@pytest.mark.skipif(not PEERS.is_dir(), reason=f"no torchvision in {PEERS}; `make test` puts it there")
def test_hf_multimodal_runs_the_tasks_and_says_what_our_model_says(make_nieh_set, tmp_path):
    from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

    checkpoint, data = tmp_path / "checkpoint", make_nieh_set()
    save_tiny_checkpoint(checkpoint, seed=0)
    arguments = ["--model", "hf-multimodal", "--model_args", f"pretrained={checkpoint},dtype=float32"]
    arguments += ["--tasks", "nieh_gt,nieh_full", "--include_path", str(packaged_folder("tasks"))]
    arguments += ["--metadata", json.dumps({"data": str(data)}), "--apply_chat_template", "--device", "cpu"]
    arguments += ["--batch_size", "1", "--log_samples", "--output_path", str(tmp_path / "theirs")]
    environment = {**os.environ, "PYTHONPATH": f"{SHIM}{os.pathsep}{PEERS}", "HF_HUB_OFFLINE": "1"}
    program = "from lm_eval.__main__ import cli_evaluate; cli_evaluate()"
    done = subprocess.run(
        [sys.executable, "-c", program, "run", *arguments], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]

    request = RunRequest(
        model="qwen2.5-vl",
        model_options={"pretrained": str(checkpoint), "dtype": "float32", "device": "cpu"},
        tasks=("nieh",),
        data=data,
        output=tmp_path / "ours",
    )
    execute(plan(request), lambda *_: lambda *_: None)
    theirs = replies(tmp_path / "theirs")
    assert len(theirs) == 10
    assert replies(tmp_path / "ours") == theirs
