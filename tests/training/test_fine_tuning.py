"""Training runs as a whole: what they write, that they go on where they ended, and what they
refuse."""

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys

import pytest
import torch
from safetensors import SafetensorError

from infthor_eval.errors import InfthorError
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training import fine_tuning
from infthor_eval.training.fine_tuning import fine_tune, prepare_run
from infthor_eval.training.recipe import read_recipe
from model_adapters import Decoding, load

from ..conftest import QUESTIONS
from ..helpers.waiting import wait_until
from .twins import read_weights

RECIPE = """
title: a small one
model: qwen2.5-vl-tiny
max_tokens: 5000
questions: {contexts: [clues]}
freeze: [vision]
optimizer: {lr: 1.0e-2, warmup_ratio: 0.0}
epochs: 4
sequences_per_step: 2
save_every: 3
"""


@pytest.fixture
def data(make_nieh_set):
    return make_nieh_set(QUESTIONS, size=56)


@pytest.fixture
def train_by_command(recipe, data, tmp_path, run_cli):
    """Trains by the command, with settings; gives its exit code and the lines of its errors."""

    def train_by_command(**settings):
        words = ["train", "--recipe", recipe, "--data", data, "--out", tmp_path / "out"]
        changes = (("--set", f"{name}={value}") for name, value in settings.items())
        code, _, err = run_cli(*words, *itertools.chain(*changes))
        return code, err.splitlines()

    return train_by_command


@pytest.fixture
def recipe(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(RECIPE)
    return str(path)


def train(recipe, data, out, **changes):
    steps = []
    run = prepare_run(read_recipe(recipe, changes), [data])
    return fine_tune(run, out, steps.append), steps


def load_trained(checkpoint):
    options = {"pretrained": str(checkpoint), "dtype": "float32", "max_tokens": "0"}
    return load("qwen2.5-vl", options, seed=0)


def by_steps(states):
    """Checkpoints, the last one last."""
    return sorted(states.glob("checkpoint-*"), key=lambda folder: int(folder.name[11:]))


def same(first, second):
    return first.keys() == second.keys() and all(first[name].equal(second[name]) for name in first)


def test_a_trained_model_answers_as_it_was_trained_to_behind_its_familys_adapter(
    recipe, data, tmp_path
):
    checkpoint, steps = train(recipe, data, tmp_path / "out", epochs=40, save_every=1000)
    assert [done.step for done in steps] == list(range(1, steps[-1].n_steps + 1))
    assert steps[-1].loss < steps[0].loss / 20
    model = load_trained(checkpoint)
    samples = find_samples({"data": str(data), "context": "clues"})
    for sample in samples.samples:
        talk = model.conversation()
        context, text = samples.request(sample)
        talk.append(*context, text)
        assert talk.reply(Decoding(max_new_tokens=10)).text == doc_target(sample.question)


TRAINING = """
import sys
from pathlib import Path
from infthor_eval.training.fine_tuning import fine_tune, prepare_run
from infthor_eval.training.recipe import read_recipe
steps = []
run = prepare_run(read_recipe(sys.argv[1]), [Path(sys.argv[2])])
fine_tune(run, Path(sys.argv[3]), steps.append)
print(steps[0].step, steps[-1].step)
"""


def test_a_run_that_is_killed_ends_with_the_weights_of_one_that_is_not(recipe, data, tmp_path):
    # Each in a process of its own: what other tests have loaded into this one may round otherwise.
    def start(name):
        words = [sys.executable, "-c", TRAINING, recipe, str(data), str(tmp_path / name)]
        return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)

    whole = start("whole")
    assert whole.communicate()[0].split() == ["1", "12"]
    killed = start("killed")
    wait_until(
        lambda: list((tmp_path / "killed").glob("states/checkpoint-*/trainer_state.json")), killed
    )
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    assert not (tmp_path / "killed" / "checkpoint").exists()
    # As if it had been killed once more, while it wrote a later state.
    states = tmp_path / "killed" / "states"
    shutil.copytree(next(states.glob("checkpoint-*")), states / "checkpoint-11")
    for name in ("optimizer.pt", "trainer_state.json"):
        (states / "checkpoint-11" / name).unlink(missing_ok=True)
    (states / "checkpoint-11" / ".tmpAbCdEf").touch()  # safetensors writes under such names
    first, last = map(int, start("killed").communicate()[0].split())
    assert 1 < first <= last == 12
    assert same(read_weights(tmp_path / "killed"), read_weights(tmp_path / "whole"))
    assert not list((tmp_path / "killed").rglob(".*"))


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("no room")])
def test_a_full_disk_at_a_checkpoint_is_one_line_and_the_run_goes_on_later(
    tmp_path, train_by_command, monkeypatch, error
):
    def full(*_):
        raise error

    with monkeypatch.context() as patched:
        patched.setattr("torch.save", full)
        code, (*others, line) = train_by_command(max_steps=1, save_every=1)
    assert code == 2
    assert not any("Traceback" in other for other in others)
    assert f"{tmp_path}/out/states: a checkpoint cannot be written (" in line
    assert "make room there and run the same command again" in line
    assert train_by_command(max_steps=1, save_every=1)[0] == 0
    assert (tmp_path / "out" / "checkpoint" / "config.json").is_file()


@pytest.mark.parametrize(
    ("written", "error"),
    [
        ("PreTrainedModel", SafetensorError("Error while serializing: No space left on device")),
        # As tokenizers raises it.
        ("PreTrainedTokenizerBase", Exception("Error while saving: No space left (os error 28)")),
    ],
)
def test_a_checkpoint_that_cannot_be_written_is_none(
    tmp_path, train_by_command, monkeypatch, written, error
):
    def full(*_, **__):
        raise error

    with monkeypatch.context() as patched:
        patched.setattr(f"transformers.{written}.save_pretrained", full)
        code, lines = train_by_command(max_steps=1)
    assert code == 2
    assert "checkpoint: the checkpoint cannot be written (Error while" in lines[-1]
    assert not list((tmp_path / "out" / "checkpoint").iterdir())
    assert train_by_command(max_steps=1)[0] == 0
    assert (tmp_path / "out" / "checkpoint" / "config.json").is_file()


def test_a_folder_is_one_runs(recipe, data, tmp_path, train_by_command):
    train(recipe, data, tmp_path / "out", max_steps=1)
    about = json.loads((tmp_path / "out" / "training.json").read_text())
    assert (about["sequences"], about["recipe"]["max_steps"]) == (5, 1)
    code, lines = train_by_command(max_steps=2)
    refusal = f"{tmp_path}/out is a run of another recipe; give another folder with --out"
    assert (code, lines[-1]) == (2, f"infthor-eval: {refusal}")


def test_adapters_are_trained_and_merged(recipe, data, tmp_path):
    pytest.importorskip("peft", reason="peft is an extra: pip install 'infthor-eval[train]'")
    lora = {"lora": {"rank": 4}, "freeze": ["vision", "embeddings", "head"], "max_steps": 3}
    run = prepare_run(read_recipe(recipe, lora), [data])
    before = {name: tensor.clone() for name, tensor in run.loaded.model.state_dict().items()}
    fine_tune(run, tmp_path / "out", lambda done: None)
    after = run.loaded.model.state_dict()
    assert after.keys() == before.keys()
    changed = {name.split(".")[-2] for name in after if not after[name].equal(before[name])}
    assert changed == {"q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj"}
    assert not any("lora" in name for name in read_weights(tmp_path / "out"))


@pytest.mark.parametrize("rope", ["dynamic", "longrope"])
def test_a_model_is_trained_under_a_rope_of_lengths_and_keeps_it(recipe, data, tmp_path, rope):
    checkpoint, _ = train(
        recipe, data, tmp_path / "out", **{"model_args.rope": f"{rope}:4", "max_steps": 1}
    )
    config = json.loads((checkpoint / "config.json").read_text())
    assert config["text_config"]["rope_parameters"]["rope_type"] == rope
    talk = load_trained(checkpoint).conversation()
    talk.append("Where is the mug?")
    assert talk.reply(Decoding(max_new_tokens=2)).n_context_tokens > 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"optimizer.lr": "0"}, "optimizer.lr is 0"),
        ({"optimiser.lr": "1"}, "unknown field `optimiser`"),
        ({"freeze": ["wheels"]}, "Invalid enum value 'wheels'"),
        ({"questions": None}, "nothing to train on"),
        ({"model": "openvla-tiny"}, "openvla-tiny cannot be trained here"),
        ({"max_tokens": "10"}, "no sequence to train on \\(longer than 10 tokens\\)"),
    ],
)
def test_what_cannot_be_is_refused(recipe, data, tmp_path, changes, message):
    with pytest.raises(InfthorError, match=message):
        train(recipe, data, tmp_path / "out", **changes)
    assert not (tmp_path / "out").exists()


def _half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


class _Evil:
    def __reduce__(self):
        return os.mkdir, ("evil",)


def _code(path):
    torch.save(_Evil(), path)


DAMAGED = {
    "weights": ("model.safetensors", _half),
    "optimizer": ("optimizer.pt", _half),
    "schedule": ("scheduler.pt", _half),
    "random numbers": ("rng_state.pth", _half),
    "state": ("trainer_state.json", _half),
    "another state": ("trainer_state.json", lambda path: path.write_text("[]")),
    "code in the optimizer": ("optimizer.pt", _code),
    "code in the schedule": ("scheduler.pt", _code),
    "code in random numbers": ("rng_state.pth", _code),
    "empty": ("optimizer.pt", lambda path: path.write_bytes(b"")),
}


def test_a_damaged_checkpoint_is_one_line_and_the_one_before_is_taken(
    recipe, data, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    train(recipe, data, tmp_path / "out", epochs=2, save_every=2)
    whole = tmp_path / "out" / "states"
    *_, before, last = by_steps(whole)
    for name, (file, damage) in DAMAGED.items():
        states = shutil.copytree(whole, tmp_path / name)
        assert fine_tuning._last_whole_checkpoint(states) == str(states / last.name)
        damage(states / last.name / file)
        capsys.readouterr()
        assert fine_tuning._last_whole_checkpoint(states) == str(states / before.name), name
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{states / last.name}: cannot be read (" in line
        assert not (states / last.name).exists()
    assert not (tmp_path / "evil").exists()


def test_a_run_goes_on_from_the_one_before(recipe, data, tmp_path, capsys):
    train(recipe, data, tmp_path / "out", epochs=2, save_every=2)
    weights = read_weights(tmp_path / "out")
    shutil.rmtree(tmp_path / "out" / "checkpoint")
    last = by_steps(tmp_path / "out" / "states")[-1]
    _half(last / "optimizer.pt")
    _, steps = train(recipe, data, tmp_path / "out", epochs=2, save_every=2)
    assert steps[0].step == int(last.name[11:]) - 1
    assert same(read_weights(tmp_path / "out"), weights)
    assert "cannot be read (" in capsys.readouterr().err
