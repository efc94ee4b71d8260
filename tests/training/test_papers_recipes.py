"""The paper's recipes as they are, but for a tiny model and a sixteenth of their lengths."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import psutil
import pytest
import yaml

from infthor_eval.training.recipe import Parallel, Recipe, read_recipe

from ..helpers.waiting import PATIENCE_S, wait_until
from .twins import read_weights

SCALE = 16
PROGRAM = Path(sys.executable).with_name("infthor-eval")


def scaled(name: str, n_processes: int) -> Recipe:
    """A recipe of the paper for a sixteenth of its length and two steps, on as many processes as
    there are."""
    published = read_recipe(name)
    assert isinstance(published, Recipe)
    return msgspec.structs.replace(
        published,
        model="qwen2.5-vl-tiny",  # a frame of which takes few tokens
        model_args={},
        max_tokens=published.max_tokens // SCALE,
        max_steps=2,
        sequences_per_step=2,
        # Sharding weights needs GPUs; a sequence is shared by as many processes as there are.
        parallel=Parallel(context=n_processes),
    )


def started(recipe: Recipe, n_processes: int, data: Path, out: Path) -> "subprocess.Popen[str]":
    """`train`, in one process or several."""
    path = out.with_suffix(".yaml")
    path.write_text(yaml.safe_dump(msgspec.to_builtins(recipe)))
    words = [PROGRAM, "train", "--recipe", path, "--data", data, "--out", out]
    return subprocess.Popen(
        [*launcher(n_processes), *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )


def launcher(n_processes: int) -> list[str]:
    """What stands before the command; a place to meet is given, as finding one asks for names of
    machines."""
    if n_processes == 1:
        return []
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    run = [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node", str(n_processes)]
    place = ["--master-addr", "127.0.0.1", "--master-port", str(port)]
    return [*run, *place, "--no-python"]


@pytest.mark.parametrize(
    ("name", "n_processes"), [("infthor_32k", 1), ("infthor_64k", 2), ("infthor_130k", 4)]
)
def test_it_trains(bundled_set, tmp_path, name, n_processes):
    recipe = scaled(name, n_processes)
    training = started(recipe, n_processes, bundled_set, tmp_path / "out")
    output, _ = training.communicate(timeout=PATIENCE_S)
    assert training.returncode == 0, output[-2000:]
    about = msgspec.json.decode((tmp_path / "out" / "training.json").read_bytes())
    assert about["recipe"]["max_tokens"] == recipe.max_tokens
    assert about["sequences"] > 0
    assert all(weight.isfinite().all() for weight in read_weights(tmp_path / "out").values())


def test_processes_that_share_sequences_and_are_killed_end_with_the_weights_of_others(
    bundled_set, tmp_path
):
    recipe = msgspec.structs.replace(
        scaled("infthor_64k", 2), max_tokens=1024, max_steps=6, save_every=2
    )
    whole = started(recipe, 2, bundled_set, tmp_path / "whole")
    assert whole.communicate(timeout=PATIENCE_S)[0]
    killed = started(recipe, 2, bundled_set, tmp_path / "killed")
    wait_until(lambda: list((tmp_path / "killed" / "states").glob("step-00000?")), killed)
    launching = psutil.Process(killed.pid)
    # Each worker has a session of its own.
    for process in (*launching.children(recursive=True), launching):
        process.kill()
    killed.communicate()
    assert not (tmp_path / "killed" / "checkpoint").exists()
    again = started(recipe, 2, bundled_set, tmp_path / "killed")
    output, _ = again.communicate(timeout=PATIENCE_S)
    assert again.returncode == 0, output[-2000:]
    assert "step 6 of 6" in output
    first, second = read_weights(tmp_path / "whole"), read_weights(tmp_path / "killed")
    assert first.keys() == second.keys()
    assert all(first[name].equal(second[name]) for name in first)
