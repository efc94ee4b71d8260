"""Every key of a checkpoint's files is accounted for, or nothing is loaded."""

import pytest
import torch
from safetensors.torch import save_file
from torch import nn

from infthor_eval.errors import ModelError
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.weights import Layout, empty_parameters, load_weights


class Small(nn.Module):
    def __init__(self):
        super().__init__()
        self.first = nn.Linear(3, 2)
        self.norm = nn.LayerNorm(2)
        self.register_buffer("bands", torch.arange(4.0), persistent=False)


UNUSED = {"head.weight": (5, 2)}
WHOLE = {
    "old.weight": torch.arange(6.0).reshape(2, 3),
    "old.bias": torch.ones(2),
    "norm.weight": torch.full((2,), 3.0),
    "norm.bias": torch.zeros(2),
    "head.weight": torch.zeros(5, 2),
}


def _loaded(folder, dtype=torch.float32):
    with empty_parameters():
        module = Small()
    layout = Layout.of(module, lambda name: name.replace("first", "old"), UNUSED)
    checkpoint = PolicyCheckpoint(folder, "mine", {})
    load_weights(module, checkpoint, layout, torch.device("cpu"), dtype)
    return module


def test_tensors_come_into_their_parameters_from_all_files(tmp_path):
    save_file({key: WHOLE[key] for key in list(WHOLE)[:2]}, tmp_path / "a.safetensors")
    save_file({key: WHOLE[key] for key in list(WHOLE)[2:]}, tmp_path / "b.safetensors")
    module = _loaded(tmp_path, torch.bfloat16)
    assert module.first.weight.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert module.norm.weight.tolist() == [3, 3]
    assert {parameter.dtype for parameter in module.parameters()} == {torch.bfloat16}
    assert not any(parameter.requires_grad for parameter in module.parameters())


def test_buffers_are_computed_not_lost(tmp_path):
    save_file(WHOLE, tmp_path / "model.safetensors")
    module = _loaded(tmp_path, torch.bfloat16)
    assert module.get_buffer("bands").tolist() == [0, 1, 2, 3]
    assert module.get_buffer("bands").dtype == torch.float32


def test_parameters_take_no_memory_before_they_are_loaded():
    with empty_parameters():
        module = Small()
    assert {parameter.device.type for parameter in module.parameters()} == {"meta"}


@pytest.mark.parametrize(
    ("without", "also", "message"),
    [
        ("norm.bias", {}, r"of mine .*: the checkpoint lacks norm\.bias$"),
        ("head.weight", {}, r"lacks head\.weight"),
        (None, {"extra": torch.ones(1)}, "has unknown extra"),
        (None, {"old.bias": torch.ones(3)}, r"another shape in old\.bias \[3\] instead of \[2\]"),
        (
            None,
            {"head.weight": torch.ones(5, 3)},
            r"another shape in head\.weight \[5, 3\] instead of \[5, 2\]",
        ),
        ("old.bias", {"extra": torch.ones(1)}, "lacks old.bias; has unknown extra"),
        (
            None,
            {f"extra{number}": torch.ones(1) for number in range(5)},
            r"extra0, extra1, extra2, \.\.\. \(5 in all\)",
        ),
    ],
)
def test_any_other_key_or_shape_ends_the_loading(tmp_path, without, also, message):
    save_file(
        {key: value for key, value in WHOLE.items() if key != without} | also,
        tmp_path / "model.safetensors",
    )
    with pytest.raises(ModelError, match=message):
        _loaded(tmp_path)


def test_a_key_in_two_files_is_refused(tmp_path):
    save_file(WHOLE, tmp_path / "a.safetensors")
    save_file({"old.bias": torch.zeros(2)}, tmp_path / "b.safetensors")
    with pytest.raises(ModelError, match=r"two files of mine have old\.bias"):
        _loaded(tmp_path)


def test_quantised_weights_are_refused(tmp_path):
    save_file(WHOLE | {"old.bias": torch.ones(2, dtype=torch.int8)}, tmp_path / "model.safetensors")
    with pytest.raises(ModelError, match=r"old\.bias of mine is torch\.int8; quantised"):
        _loaded(tmp_path)


def test_a_folder_without_weights_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"mine has no \*\.safetensors"):
        _loaded(tmp_path)
