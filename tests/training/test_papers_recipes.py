"""A recipe of the paper as it is, but for a tiny model and a sixteenth of its lengths."""

import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
import yaml
from safetensors.torch import load_file

from infthor_eval.training.recipe import Parallel, Recipe, read_recipe

SCALE = 16
CODE = "from infthor_eval.cli import main; main()"


@pytest.mark.slow
def test_it_trains(bundled_set: Path, tmp_path: Path) -> None:
    published = read_recipe("infthor_32k")
    assert isinstance(published, Recipe)
    recipe = msgspec.structs.replace(
        published,
        model="qwen2.5-vl-tiny",  # a frame of which takes few tokens
        model_args={},
        max_tokens=published.max_tokens // SCALE,
        max_steps=2,
        sequences_per_step=2,
        parallel=Parallel(),  # sharding weights needs GPUs
    )
    out = tmp_path / "out"
    (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(msgspec.to_builtins(recipe)))
    words = ["train", "--recipe", tmp_path / "recipe.yaml", "--data", bundled_set, "--out", out]
    command = [sys.executable, "-c", CODE, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stderr[-2000:]
    about = msgspec.json.decode((out / "training.json").read_bytes())
    assert about["recipe"]["max_tokens"] == recipe.max_tokens
    assert about["sequences"] > 0
    weights = load_file(out / "checkpoint" / "model.safetensors")
    assert all(weight.isfinite().all() for weight in weights.values())
