"""Which checkpoints real vLLM loads, and which are refused before it starts."""

import json
import shutil
from pathlib import Path

import pytest
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from infthor_eval.errors import ModelError
from model_adapters.vllm.cpu import runs_on_cpu

from ...asking import up_to, user
from ..families import adapter_of


def _keys(folder):
    with safe_open(folder / "model.safetensors", "pt") as weights:
        return list(weights.keys())


@pytest.mark.parametrize("family", ["llava-onevision", "llava"])
def test_towers_of_both_forms_are_loaded(family, start, in_process, checkpoints, frames, tmp_path):
    flat = Path(shutil.copytree(checkpoints[family], tmp_path / "flat"))
    weights = load_file(flat / "model.safetensors")
    renamed = {
        name.replace("vision_tower.vision_model.", "vision_tower."): item
        for name, item in weights.items()
    }
    save_file(renamed, flat / "model.safetensors", metadata={"format": "pt"})
    levelled = {
        name.replace("vision_tower.", "vision_tower.vision_model."): item
        for name, item in renamed.items()
    }
    published = Path(shutil.copytree(checkpoints[family], tmp_path / "published"))
    save_file(levelled, published / "model.safetensors", metadata={"format": "pt"})
    assert _keys(flat) != _keys(published)
    name = adapter_of(family)
    expected = (
        in_process(family, name).answer(user(*frames, "Where is the mug?"), up_to(20)).token_ids
    )
    for folder in (flat, published):
        model = start(family, name, pretrained=folder)
        assert model.answer(user(*frames, "Where is the mug?"), up_to(20)).token_ids == expected
        model.close()


def test_heads_that_a_cpu_has_no_kernel_for_are_refused_at_the_start(start, checkpoints, tmp_path):
    if not runs_on_cpu():
        pytest.skip("this vLLM runs on a GPU")
    small = Path(shutil.copytree(checkpoints["pixtral"], tmp_path / "small"))
    config = json.loads((small / "config.json").read_text())
    config["text_config"]["head_dim"] = 16
    (small / "config.json").write_text(json.dumps(config))
    with pytest.raises(
        ModelError, match=r"attention heads have 16 numbers, .* kernels for 32, 64, .* transformers"
    ):
        start("pixtral", pretrained=small)
