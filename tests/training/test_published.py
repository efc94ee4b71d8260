"""Checkpoints of torch's distributed kind become ones that adapters load."""

import io
import pickle

import pytest
import torch
import torch.distributed.checkpoint as dcp

from infthor_eval.errors import DataError, ModelError
from infthor_eval.training.published import find_weights, import_weights
from infthor_eval.training.starting_model import load_starting_model
from model_adapters import load

from ..helpers.command_line import option_words
from ..helpers.hub import COMMIT, serve_hub

LABEL = "llava_onevison_7b_32k"  # that of the published READMEs
REPOSITORY = "PEARLS-Lab/infini-thor"


# Beginnings of names now, and in the transformers of the published trainer.
LLAVA_IN_4_49 = {
    "model.vision_tower.": "vision_tower.vision_model.",
    "model.language_model.": "language_model.model.",
    "lm_head.": "language_model.lm_head.",
    "model.": "",
}


def old_name(name, renamed):
    new, old = next((pair for pair in renamed.items() if name.startswith(pair[0])), ("", ""))
    return old + name.removeprefix(new)


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
        ("qwen2.5-vl-tiny", {"model.visual.": "visual.", "model.language_model.": "model."}),
        ("llava-onevision-tiny", LLAVA_IN_4_49),
    ],
)
def test_weights_are_taken_over_by_the_names_of_the_transformers_of_the_published_trainer(
    tmp_path, model, renamed
):
    """As the hub's files name them: `visual.`, `model.layers.`; `language_model.model.layers.`,
    `vision_tower.`."""
    trained, other = (load_starting_model(model, {}, "plain", seed) for seed in (1, 0))
    state = trained.model.state_dict()
    state = {f"model.{old_name(name, renamed)}": tensor for name, tensor in state.items()}
    dcp.save(state, checkpoint_id=tmp_path / "dcp", no_dist=True)
    imported = import_weights(other, tmp_path / "dcp")
    assert (imported.n_kept, imported.n_ignored) == (0, 0)
    wanted = trained.model.state_dict()
    assert all(tensor.equal(wanted[name]) for name, tensor in other.model.state_dict().items())


def test_a_chat_keeps_the_chat_template(tmp_path, run_cli):
    tiny_qwen = load_starting_model("qwen2.5-vl-tiny", {}, "chat", 0)
    folder = saved(tiny_qwen, tmp_path / "dcp", "model.")
    words = option_words(model="qwen2.5-vl-tiny", prompt="chat", out=tmp_path / "out")
    code, _, err = run_cli("import-checkpoint", folder, *words)
    assert code == 0, err
    options = {"pretrained": str(tmp_path / "out"), "dtype": "float32"}
    loaded = load("qwen2.5-vl", options, seed=0).loaded
    assert loaded.template == tiny_qwen.template


def test_the_command_writes_what_the_adapter_loads(tmp_path, run_cli):
    folder = saved(tiny(0), tmp_path / "dcp", "model.")
    words = option_words(model="llava-onevision-tiny", out=tmp_path / "out")
    code, output, err = run_cli("import-checkpoint", folder, *words)
    assert (code, "0 kept, 0 other tensors ignored" in output) == (0, True), err
    options = {"pretrained": str(tmp_path / "out"), "dtype": "float32", "max_tokens": "0"}
    model = load("llava-onevision", options, seed=0)
    ours, theirs = model.loaded.model.state_dict(), tiny(0).model.state_dict()
    assert all(torch.equal(ours[name], theirs[name]) for name in theirs)
    tokenize = model.loaded.tokenizer
    assert len(tokenize("<|act|>MoveAhead<|act|>", add_special_tokens=False)["input_ids"]) >= 3


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


class _Code:
    def __reduce__(self):
        return print, ("run",)


# os.system by a module that the metadata may name.
_BY_WAY = b"\x80\x04\x8c%torch.distributed.checkpoint.metadata\x8c\x09os.system\x93\x8c\x01:\x85R."


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (pickle.dumps(_Code()), r"builtins\.print"),
        (_BY_WAY, r"torch\.distributed\.checkpoint\.metadata\.os\.system"),
    ],
)
def test_a_checkpoint_runs_no_code(content, named, tmp_path, capsys):
    (tmp_path / ".metadata").write_bytes(content)
    with pytest.raises(DataError, match=f"names {named}, which may run code"):
        import_weights(tiny(0), tmp_path)
    assert capsys.readouterr().out == ""


def _of_the_trainer(loaded, folder):
    """A checkpoint with everything that the published trainer stores, in a folder of the READMEs'
    layout, as `snapshot_download` leaves it."""
    state = loaded.model.state_dict()
    weights = {old_name(name, LLAVA_IN_4_49): tensor for name, tensor in state.items()}
    losses = io.BytesIO()
    torch.save([0.5], losses)
    moments = {
        f"state.{name}.{moment}": torch.zeros_like(weights[name])
        for name in list(weights)[:3]
        for moment in ("exp_avg", "exp_avg_sq")
    }
    states = {
        "model": weights,
        "optimizer": moments,
        "lr_scheduler": {"last_epoch": 500},
        "dataloader": {"dp_rank_0": losses},
        "train_state": {"step": torch.tensor(500, dtype=torch.int32), "log_steps": losses},
    }
    dcp.save(states, checkpoint_id=folder, no_dist=True)
    return folder


@pytest.fixture(scope="module")
def snapshot(tmp_path_factory):
    """A folder as a download of the checkpoints of the hub's repository leaves it."""
    root = tmp_path_factory.mktemp("snapshot")
    _of_the_trainer(tiny(1), root / "checkpoints" / LABEL)
    return root


@pytest.fixture
def hub(snapshot, tmp_path, monkeypatch):
    """A local server in the hub's place, which has that repository."""
    paths = sorted(path for path in snapshot.rglob("*") if path.is_file())
    files = {str(path.relative_to(snapshot)): path.read_bytes() for path in paths}
    files["README.md"] = b"of the data"
    files["checkpoints/other/__0_0.distcp"] = b"not asked for"
    with serve_hub(f"models/{REPOSITORY}", files) as (address, answers):
        constants = "huggingface_hub.constants"
        monkeypatch.setattr(f"{constants}.HF_HUB_OFFLINE", False)
        monkeypatch.setattr(f"{constants}.ENDPOINT", address)
        template = "/{repo_id}/resolve/{revision}/{filename}"
        monkeypatch.setattr(f"{constants}.HUGGINGFACE_CO_URL_TEMPLATE", address + template)
        monkeypatch.setattr(f"{constants}.HF_HUB_CACHE", str(tmp_path / "hub"))
        yield answers


def _has_weights_of(loaded, seed):
    wanted = tiny(seed).model.state_dict()
    return all(tensor.equal(wanted[name]) for name, tensor in loaded.model.state_dict().items())


def test_the_layout_of_the_published_readmes_is_taken_from_a_downloaded_folder(
    snapshot, tmp_path, run_cli
):
    folder = snapshot / "checkpoints" / LABEL
    assert {path.name for path in folder.iterdir()} == {".metadata", "__0_0.distcp"}
    options = option_words(model="llava-onevision-tiny", out=tmp_path / "out")
    code, output, err = run_cli("import-checkpoint", folder, *options)
    assert (code, " 0 kept, 7 other tensors ignored" in output) == (0, True), err
    options = {"pretrained": str(tmp_path / "out"), "dtype": "float32"}
    assert _has_weights_of(load("llava-onevision", options, seed=0).loaded, 1)


def test_the_layout_of_the_published_readmes_is_taken_from_the_hub(hub, tmp_path, run_cli):
    place = f"{REPOSITORY}/checkpoints/{LABEL}"
    options = option_words(model="llava-onevision-tiny", out=tmp_path / "out")
    code, output, err = run_cli("import-checkpoint", place, *options)
    assert (code, " 0 kept, 7 other tensors ignored" in output) == (0, True), err
    inside = f"checkpoints/{LABEL}"
    assert sorted(hub.fetched) == [f"{inside}/.metadata", f"{inside}/__0_0.distcp"]
    folder = find_weights(place, COMMIT)
    assert folder.parts[-3:] == (COMMIT, "checkpoints", LABEL) and len(hub.fetched) == 2
    with pytest.raises(ModelError, match=r"has no checkpoint there at 0000"):
        find_weights(f"{REPOSITORY}/checkpoints/llava_onevision")


def test_a_folder_of_the_hub_with_a_converted_checkpoint_is_loaded(hub, tmp_path, run_cli):
    folder = saved(tiny(1), tmp_path / "dcp", "model.")
    options = option_words(model="llava-onevision-tiny", out=tmp_path / "out")
    assert run_cli("import-checkpoint", folder, *options)[0] == 0
    converted = {
        f"checkpoints/converted/{path.name}": path.read_bytes()
        for path in (tmp_path / "out").iterdir()
    }
    hub.files.update(converted)
    pretrained = f"{REPOSITORY}/checkpoints/converted"
    loaded = load("llava-onevision", {"pretrained": pretrained, "dtype": "float32"}, seed=0).loaded
    assert _has_weights_of(loaded, 1)
    assert loaded.identity["checkpoint"] == pretrained
    assert loaded.identity["revision"] == COMMIT
    assert all(name.startswith("checkpoints/converted/") for name in hub.fetched)


def test_a_model_says_how_a_trainers_checkpoint_is_converted(hub, snapshot):
    for place in (f"{REPOSITORY}/checkpoints/{LABEL}", str(snapshot / "checkpoints" / LABEL)):
        with pytest.raises(ModelError, match=f"`infthor-eval import-checkpoint {place} --out DIR`"):
            load("llava-onevision", {"pretrained": place}, seed=0)


def test_of_several_steps_the_last_is_taken_as_by_the_published_trainer(tmp_path):
    for step in (0, 100, 20, 500):
        (tmp_path / f"step-{step}").mkdir()
        if step != 500:  # not finished
            (tmp_path / f"step-{step}" / ".metadata").touch()
    assert find_weights(str(tmp_path)) == tmp_path / "step-100"
    assert find_weights(str(tmp_path / "step-20")) == tmp_path / "step-20"


@pytest.mark.parametrize("place", ["nowhere", "./no/where/here", "/no/where", "owner/name/../up"])
def test_no_folder_and_no_hub_id_is_one_line(place):
    with pytest.raises(ModelError, match=r"^[^\n]*: there is no such folder, and hub ids have"):
        find_weights(place)


def test_without_network_the_download_of_the_folder_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", True)
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path))
    inside = f"checkpoints/{LABEL}"
    download = rf"`hf download {REPOSITORY} --include '{inside}/\*' --local-dir DIR`"
    with pytest.raises(ModelError, match=f"{download} and give DIR/{inside}$"):
        find_weights(f"{REPOSITORY}/{inside}")
