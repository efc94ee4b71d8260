"""The paper's recipes as they are, but for a tiny model and a sixteenth of their lengths."""

import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
import yaml
from safetensors.torch import load_file

from infthor_eval.training.recipe import Parallel, Recipe, read_recipe

SCALE = 16
PROGRAM = Path(sys.executable).with_name("infthor-eval")


def launcher(n_processes: int) -> list[str]:
    """What stands before the command; a place to meet is given, as finding one asks for names of machines."""
    if n_processes == 1:
        return []
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    place = ["--master-addr", "127.0.0.1", "--master-port", str(port)]
    return [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node", str(n_processes), *place, "--no-python"]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "n_processes"), [("infthor_32k", 1), ("infthor_64k", 2), ("infthor_130k", 4)])
def test_it_trains(bundled_set: Path, tmp_path: Path, name: str, n_processes: int) -> None:
    published = read_recipe(name)
    assert isinstance(published, Recipe)
    recipe = msgspec.structs.replace(
        published,
        model="qwen2.5-vl-tiny",  # a frame of which takes few tokens
        model_args={},
        max_tokens=published.max_tokens // SCALE,
        max_steps=2,
        sequences_per_step=2,
        # Sharding weights needs GPUs; a sequence is shared by as many processes as there are.
        parallel=Parallel(context=n_processes),
    )
    out = tmp_path / "out"
    (tmp_path / "recipe.yaml").write_text(yaml.safe_dump(msgspec.to_builtins(recipe)))
    words = ["train", "--recipe", tmp_path / "recipe.yaml", "--data", bundled_set, "--out", out]
    command = [*launcher(n_processes), PROGRAM, *words]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, timeout=580)
    assert done.returncode == 0, done.stderr[-2000:]
    about = msgspec.json.decode((out / "training.json").read_bytes())
    assert about["recipe"]["max_tokens"] == recipe.max_tokens
    assert about["sequences"] > 0
    weights = load_file(out / "checkpoint" / "model.safetensors")
    assert all(weight.isfinite().all() for weight in weights.values())
