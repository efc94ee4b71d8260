"""Configs of published checkpoints: their models have the published number of parameters."""

import pytest

from model_adapters.hf.rehearsal.model import known_checkpoints, load_shapes
from model_adapters.options.families import HfVlmOptions
from model_adapters.registry import read_options

from ...checkpoints import FAMILIES

# Tokens of a frame of 300x300, as the published evaluation counts them: with markers of Qwen2.5-VL.
PUBLISHED = {
    "Qwen/Qwen2.5-VL-7B-Instruct": 121 + 2,
    "llava-hf/llava-onevision-qwen2-7b-ov-hf": 1485,
    "deepseek-community/deepseek-vl-7b-chat": 576,
    "mistral-community/pixtral-12b": 380,
}


@pytest.mark.parametrize("repository", known_checkpoints())
def test_the_model_has_the_published_number_of_parameters(repository):
    known = known_checkpoints()[repository]
    rehearsed = load_shapes(HfVlmOptions(pretrained=repository))
    assert rehearsed.options.pretrained == repository
    assert {str(weight.dtype) for weight in rehearsed.model.parameters()} == {
        f"torch.{known.config['dtype']}"
    }
    if known.parameters is not None:
        assert rehearsed.model.num_parameters() == known.parameters


@pytest.mark.parametrize(("repository", "tokens"), PUBLISHED.items())
def test_a_frame_has_the_published_number_of_tokens(repository, tokens):
    family = load_shapes(HfVlmOptions(pretrained=repository)).family
    placeholder = family.placeholder_id
    written = family.template_ids(placeholder)
    assert len(family.frame_ids((300, 300))) + len(written) - 1 == tokens


def test_the_published_models_usual_checkpoints_are_kept():
    usual = {read_options(name, {}).pretrained for name in FAMILIES}
    assert usual == set(PUBLISHED) <= set(known_checkpoints())
