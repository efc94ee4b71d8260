"""Checkpoints are saved by their published names, and transformers loads the same weights from
them."""

import pytest
import torch
from safetensors import safe_open
from transformers import AutoModelForImageTextToText

from model_adapters.hf.loading.tower_names import published_name

from ...checkpoints import twin


@pytest.mark.parametrize(
    ("name", "published"),
    [
        (
            "vision_tower.encoder.layers.0.mlp.fc1.bias",
            "vision_tower.vision_model.encoder.layers.0.mlp.fc1.bias",
        ),
        (
            "model.vision_tower.embeddings.position",
            "model.vision_tower.vision_model.embeddings.position",
        ),
        (
            "vision_tower.vision_model.encoder.layers.0.bias",
            "vision_tower.vision_model.encoder.layers.0.bias",
        ),
        # Pixtral.
        ("vision_tower.transformer.layers.0.bias", "vision_tower.transformer.layers.0.bias"),
        # Idefics 3.
        ("model.vision_model.encoder.layers.0.bias", "model.vision_model.encoder.layers.0.bias"),
        ("language_model.model.embed_tokens.weight", "language_model.model.embed_tokens.weight"),
    ],
)
def test_only_flat_towers_get_a_level(name, published):
    assert published_name(name) == published


def test_a_saved_checkpoint_has_them_and_loads_as_it_was(tmp_path):
    description = twin("llava-onevision")
    description.save(tmp_path, seed=3)
    with safe_open(tmp_path / "model.safetensors", "pt") as weights:
        towers = [name for name in weights.keys() if name.startswith("vision_tower.")]  # noqa: SIM118
    assert towers
    assert all(name.startswith("vision_tower.vision_model.") for name in towers)
    tokenizer = description.tokenizer()
    drawn = description.model(
        tokenizer, description.model_config(tokenizer), 3, "sdpa"
    ).state_dict()
    read = AutoModelForImageTextToText.from_pretrained(tmp_path).state_dict()
    assert all(torch.equal(drawn[name], read[name]) for name in drawn)
