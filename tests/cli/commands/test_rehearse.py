"""`doctor --rehearse`: what a model needs on a GPU, on the terminal and as JSON."""

import json
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.cli.rehearsal import rehearse
from infthor_eval.storage.folders import packaged_folder

from ...helpers.bundled import BUNDLED
from ...helpers.command_line import assert_refused


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short contexts, one kind of GPU, and hardly any time for pictures."""
    monkeypatch.setattr(rehearse, "_CONTEXTS", (4096, 8192))
    monkeypatch.setattr(rehearse, "_GIGABYTES", (24, 48, 80))
    monkeypatch.setattr(rehearse, "_SECONDS", 0.05)


NANO = str(packaged_folder("models/qwen2.5-vl-nano"))


def test_a_folders_model_is_rehearsed_on_a_sets_frames(run_cli: Any) -> None:
    code, out, err = run_cli(
        "doctor",
        "--rehearse",
        *("--model", "hf-vlm", "--model-args", f"pretrained={NANO},dtype=bfloat16"),
        *("--tasks", "nieh_full,nieh_gt,nieh_haystack_8k,infthor_plans"),
        *("--data", str(BUNDLED)),
        "--json",
    )
    assert (code, err) == (0, "")
    (found,) = json.loads(out)
    config = json.loads((Path(NANO) / "config.json").read_text())["text_config"]
    tokens = {task["name"]: task["tokens"] for task in found["tasks"]}
    frames = max(len(list(folder.iterdir())) for folder in BUNDLED.glob("metadata/*/img"))
    assert found["frames"]["longest"] == frames
    assert found["frames"]["size"] == [300, 300]
    assert tokens["nieh_full"] == frames * found["frame_tokens"] + 110
    assert tokens["nieh_haystack_8k"] == 8110
    assert tokens["nieh_gt"] < tokens["nieh_full"]
    assert tokens["infthor_plans"] is None
    per_token = 2 * 2 * config["num_hidden_layers"] * config["num_key_value_heads"]
    per_token *= config["hidden_size"] // config["num_attention_heads"]
    assert [context["cache"] for context in found["contexts"]] == [
        4096 * per_token,
        8192 * per_token,
    ]
    assert found["weights"]["bfloat16"] == 2 * found["parameters"]
    assert found["images"]["here"] > 0 and found["images"]["by_gpu"] > 0
    assert [gpu["tokens"] for gpu in found["gpus"]] == sorted(
        gpu["tokens"] for gpu in found["gpus"]
    )
    assert not any("hf download" in command for command in found["commands"])
    assert found["commands"][-1].startswith("infthor-eval --model hf-vlm --model-args dtype=")


def test_people_read_lines_and_what_is_missing_is_said(
    run_cli: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    config = json.loads((Path(NANO) / "config.json").read_text())
    (tmp_path / "config.json").write_text(json.dumps(config))
    words = ["--model", "hf-vlm", "--model-args", f"pretrained={tmp_path}", "--tasks", "nieh_full"]
    code, out, err = run_cli("doctor", "--rehearse", *words)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert any(line.startswith("frames       cannot be counted: ") for line in lines)
    assert any("a token of a reply: " in line and "no mask" in line for line in lines)
    assert any("which the flash kernel does not take" in line for line in lines)
    assert any("208 trajectories, the longest of 1,223 frames" in line for line in lines)
    assert any("its context is unknown" in line for line in lines)
    assert any(line.startswith("  infthor-eval plan --model hf-vlm ") for line in lines)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--rehearse",), "--rehearse needs --model and --tasks"),
        (("--model", "qwen2.5-vl"), "add --rehearse"),
        (("--rehearse", "--model", "qwen2.5-vl", "--tasks", "nieh_ful"), "nieh_full"),
        (("--rehearse", "--model", "qwen2.5", "--tasks", "nieh"), "qwen2.5-vl"),
        (("--rehearse", "--model", "openai:model=x", "--tasks", "nieh"), "loads no checkpoint"),
        (("--rehearse", "--model", "hf-vlm", "--tasks", "nieh"), "Qwen/Qwen3-VL-8B-Instruct"),
    ],
)
def test_misuse_is_one_line(run_cli: Any, words: tuple[str, ...], reason: str) -> None:
    assert_refused(run_cli("doctor", *words), reason)
