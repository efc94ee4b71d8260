"""Checkpoints of torch's distributed kind become ones that adapters load."""

import pytest
import torch
import torch.distributed.checkpoint as dcp

from infthor_eval.errors import DataError
from infthor_eval.training.published import import_weights
from infthor_eval.training.starting_model import load_starting_model
from model_adapters import load

from ..helpers.command_line import option_words


def tiny(seed):
    return load_starting_model("llava-onevision-tiny", {}, "plain", seed)


def saved(loaded, folder, prefix, *, without=(), more=None):
    state = {f"{prefix}{name}": tensor for name, tensor in loaded.model.state_dict().items()}
    state = {
        name: tensor for name, tensor in state.items() if not any(part in name for part in without)
    }
    dcp.save(state | (more or {}), checkpoint_id=folder, no_dist=True)
    return folder


@pytest.mark.parametrize("prefix", ["", "model.", "app.model."])
def test_weights_are_taken_over_whatever_stands_before_their_names(tmp_path, prefix):
    trained, other = tiny(1), tiny(0)
    moments = {
        f"optim.state.{name}.exp_avg": tensor
        for name, tensor in list(trained.model.state_dict().items())[:5]
    }
    imported = import_weights(
        other, saved(trained, tmp_path / "dcp", prefix, without=("vision_tower",), more=moments)
    )
    assert imported.n_ignored == 5
    assert imported.n_kept > 0
    begun = tiny(0).model.state_dict()
    for name, tensor in other.model.state_dict().items():
        wanted = begun if "vision_tower" in name else trained.model.state_dict()
        assert tensor.equal(wanted[name]), name


@pytest.mark.parametrize(
    ("model", "renamed"),
    [
        ("qwen2.5-vl-tiny", [("model.visual.", "visual."), ("model.language_model.", "model.")]),
        (
            "llava-onevision-tiny",
            [
                ("model.vision_tower.", "vision_tower.vision_model."),
                ("model.language_model.", "language_model.model."),
                ("lm_head.", "language_model.lm_head."),
                ("model.", ""),
            ],
        ),
    ],
)
def test_weights_are_taken_over_by_the_names_of_the_transformers_of_the_published_trainer(
    tmp_path, model, renamed
):
    """As the hub's files name them: `visual.`, `model.layers.`; `language_model.model.layers.`,
    `vision_tower.`."""
    trained, other = (load_starting_model(model, {}, "plain", seed) for seed in (1, 0))

    def old(name):
        new, before = next((pair for pair in renamed if name.startswith(pair[0])), ("", ""))
        return before + name.removeprefix(new)

    state = {f"model.{old(name)}": tensor for name, tensor in trained.model.state_dict().items()}
    dcp.save(state, checkpoint_id=tmp_path / "dcp", no_dist=True)
    imported = import_weights(other, tmp_path / "dcp")
    assert (imported.n_kept, imported.n_ignored) == (0, 0)
    wanted = trained.model.state_dict()
    assert all(tensor.equal(wanted[name]) for name, tensor in other.model.state_dict().items())


def test_a_chat_keeps_the_chat_template(tmp_path, run_cli):
    tiny_qwen = load_starting_model("qwen2.5-vl-tiny", {}, "chat", 0)
    folder = saved(tiny_qwen, tmp_path / "dcp", "model.")
    words = (
        "import-checkpoint",
        folder,
        *option_words(model="qwen2.5-vl-tiny", prompt="chat", out=tmp_path / "out"),
    )
    code, _, err = run_cli(*words)
    assert code == 0, err
    loaded = load(
        "qwen2.5-vl", {"pretrained": str(tmp_path / "out"), "dtype": "float32"}, seed=0
    ).loaded
    assert loaded.template == tiny_qwen.template


def test_the_command_writes_what_the_adapter_loads(tmp_path, run_cli):
    folder = saved(tiny(0), tmp_path / "dcp", "model.")
    words = [
        "import-checkpoint",
        folder,
        *option_words(model="llava-onevision-tiny", out=tmp_path / "out"),
    ]
    code, output, err = run_cli(*words)
    assert (code, "0 kept, 0 other tensors ignored" in output) == (0, True), err
    options = {"pretrained": str(tmp_path / "out"), "dtype": "float32", "max_tokens": "0"}
    model = load("llava-onevision", options, seed=0)
    ours, theirs = model.loaded.model.state_dict(), tiny(0).model.state_dict()
    assert all(torch.equal(ours[name], theirs[name]) for name in theirs)
    assert (
        len(
            model.loaded.tokenizer("<|act|>MoveAhead<|act|>", add_special_tokens=False)["input_ids"]
        )
        >= 3
    )


def test_what_is_none_or_anothers_is_one_line(tmp_path):
    with pytest.raises(DataError, match="not a distributed checkpoint"):
        import_weights(tiny(0), tmp_path)
    dcp.save({"wheels": torch.zeros(2)}, checkpoint_id=tmp_path / "a", no_dist=True)
    with pytest.raises(DataError, match="no weight of this model"):
        import_weights(tiny(0), tmp_path / "a")
    name = next(iter(tiny(0).model.state_dict()))
    dcp.save({name: torch.zeros(3)}, checkpoint_id=tmp_path / "b", no_dist=True)
    with pytest.raises(DataError, match=r"is \(3,\), the model's"):
        import_weights(tiny(0), tmp_path / "b")
