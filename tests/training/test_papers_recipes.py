"""The paper's recipes, each as it is but for a tiny model and a sixteenth of its lengths and processes."""

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


def scaled(name: str) -> Recipe:
    recipe = read_recipe(name)
    assert isinstance(recipe, Recipe)
    return msgspec.structs.replace(
        recipe,
        model="qwen2.5-vl-tiny",  # a frame of which takes few tokens
        model_args={},
        max_tokens=recipe.max_tokens // SCALE,
        max_steps=2,
        sequences_per_step=2,
        # Sharding weights needs GPUs; of processes that share a sequence there are two here.
        parallel=Parallel(context=min(recipe.parallel.context, 2)),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["infthor_32k"])
def test_a_recipe_trains(name: str, bundled_set: Path, tmp_path: Path) -> None:
    recipe, out, script = scaled(name), tmp_path / "out", tmp_path / "train.py"
    (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(msgspec.to_builtins(recipe)))
    script.write_text(CODE)
    processes = recipe.parallel.context
    launcher = ["-m", "torch.distributed.run", "--nproc-per-node", processes, "--master-port", "0"] * (processes > 1)
    words = ["train", "--recipe", tmp_path / "recipe.yaml", "--data", bundled_set, "--out", out]
    command = [sys.executable, *map(str, [*launcher, script, *words])]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stderr[-2000:]
    about = msgspec.json.decode((out / "training.json").read_bytes())
    assert about["recipe"]["max_tokens"] == recipe.max_tokens
    assert about["sequences"] > 0
    weights = load_file(out / "checkpoint" / "model.safetensors")
    assert all(weight.isfinite().all() for weight in weights.values())
