"""The model that a training starts from: rotary frequencies that depend on the length."""

from typing import Any

import pytest
import torch

from infthor_eval.training.batches import collate
from infthor_eval.training.network import SequenceModel
from infthor_eval.training.starting_model import load_starting_model
from model_adapters.hf.loading.loaded import LoadedCheckpoint

from .twins import PAD, sequence, write_frames

LLAVA = "llava-onevision-tiny"
ORIGINAL = 32_768  # its length, as that of LLaVA-OneVision 7B


def _start(rope: str | None, max_tokens: int) -> LoadedCheckpoint:
    options = {"dtype": "float32"} | ({} if rope is None else {"rope": rope})
    return load_starting_model(LLAVA, options, "plain", 0, max_tokens)


def _rotary(loaded: LoadedCheckpoint) -> Any:
    return loaded.model.get_decoder().rotary_emb


def _frequencies(base: float, width: int) -> torch.Tensor:
    return 1.0 / base ** (torch.arange(0, width, 2) / width)


@pytest.mark.parametrize("n_tokens", [ORIGINAL, 65_536, 131_072])
def test_dynamic_frequencies_are_those_of_the_recipes_length(n_tokens):
    """By hand, as the published trainer's call of transformers 4.49 has them."""
    rotary, plain = (_rotary(_start(rope, n_tokens)) for rope in ("dynamic:4", None))
    width, base = 2 * len(plain.inv_freq), plain.config.rope_parameters["rope_theta"]
    scaled = base * (4 * n_tokens / ORIGINAL - 3) ** (width / (width - 2))
    torch.testing.assert_close(rotary.inv_freq, _frequencies(scaled, width))
    torch.testing.assert_close(plain.inv_freq, _frequencies(base, width))
    assert rotary.attention_scaling == 1.0


@pytest.mark.parametrize(("n_tokens", "divisor"), [(ORIGINAL, 1), (65_536, 4)])
def test_longrope_divides_the_frequencies_where_the_recipes_length_is_beyond_the_original(
    n_tokens, divisor
):
    rotary, plain = (_rotary(_start(rope, n_tokens)) for rope in ("longrope:4", None))
    torch.testing.assert_close(rotary.inv_freq, plain.inv_freq / divisor)
    assert rotary.attention_scaling == 1.0


@pytest.mark.parametrize("rope", ["dynamic:4", "longrope:4"])
def test_the_loss_is_that_under_these_frequencies_whatever_was_computed_before(rope, tmp_path):
    def loss(rope: str | None, max_tokens: int) -> float:
        loaded = _start(rope, max_tokens)
        item = sequence(loaded, write_frames(tmp_path, 1), "a mug on the desk")
        batch = collate([item], loaded.family, PAD)
        with torch.no_grad():
            model = SequenceModel(loaded)
            first, again = (float(model(**batch)["loss"]) for _ in range(2))
        assert first == again
        return first

    assert loss(rope, ORIGINAL) == loss(None, ORIGINAL) != loss(rope, 4 * ORIGINAL)
