"""Models with a name of their own, on tiny checkpoints of their families."""

import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters import load, options_of
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.uncached import UncachedModel

from ...asking import ask, load_saved

# Name to the family of its tiny checkpoint, and a usual checkpoint.
NAMED = {
    "qwen3-vl": ("qwen3_vl", "Qwen/Qwen3-VL-8B-Instruct"),
    "qwen3-vl-moe": ("qwen3_vl_moe", "Qwen/Qwen3-VL-30B-A3B-Instruct"),
    "qwen3.5": ("qwen3_5", "Qwen/Qwen3.5-9B"),
    "internvl3.5": ("internvl", "OpenGVLab/InternVL3_5-8B-HF"),
    "gemma3": ("gemma3", "google/gemma-3-12b-it"),
    "gemma4": ("gemma4", "google/gemma-4-E4B-it"),
    "smolvlm2": ("smolvlm", "HuggingFaceTB/SmolVLM2-2.2B-Instruct"),
    "glm-4.6v": ("glm46v", "zai-org/GLM-4.6V-Flash"),
    "mistral-small": ("mistral3", "mistralai/Mistral-Small-3.1-24B-Instruct-2503"),
    "llama4": ("llama4", "meta-llama/Llama-4-Scout-17B-16E-Instruct"),
    "molmo2": ("molmo2", "allenai/Molmo2-8B"),
}


@pytest.mark.parametrize("name", NAMED)
def test_a_name_runs_its_family_as_hf_vlm_does(name, tiny_family, frames):
    family, usual = NAMED[name]
    assert options_of(name)["pretrained"].default == usual
    shares = name != "molmo2"
    settings = {} if shares else {"share_prefix": "false"}
    model, generic = (
        load_saved(name, tiny_family(family)),
        load_saved("hf-vlm", tiny_family(family), **settings),
    )
    assert isinstance(model, TransformersModel if shares else UncachedModel)
    parts = (*frames[:2], "\nWhat is it?")
    assert ask(model, *parts) == ask(generic, *parts)
    assert model.identity() | {"adapter": "hf-vlm"} == generic.identity()


def test_a_checkpoint_of_another_model_is_refused(tiny_family):
    with pytest.raises(ModelError, match=r"is a gemma3 checkpoint, not qwen3_vl; try hf-vlm"):
        load_saved("qwen3-vl", tiny_family("gemma3"))


@pytest.mark.parametrize(
    ("name", "setting", "value"),
    [
        ("qwen3-vl", "max_pixels", "4096"),
        ("gemma4", "soft_tokens", "140"),
        ("smolvlm2", "image_splitting", "false"),
    ],
)
def test_a_size_of_frames_changes_their_tokens_and_the_identity(
    name, setting, value, tiny_family, frames
):
    folder = tiny_family(NAMED[name][0])
    usual, changed = load_saved(name, folder), load_saved(name, folder, **{setting: value})
    fewer, more = sorted(each.tokens_per_frame(frames[0]) for each in (usual, changed))
    assert fewer < more
    assert usual.identity()["image_processor"] != changed.identity()["image_processor"]


def test_sizes_that_gemma_4_does_not_know_are_refused():
    with pytest.raises(UsageError, match="soft_tokens=100: give one of 70, 140, 280, 560, 1120"):
        load("gemma4", {"soft_tokens": "100"}, 0)
