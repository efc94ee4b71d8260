"""Continuations answered together by language models whose layers attend to a window or a chunk of
what is before, against the same asked one by one."""

import pytest
import torch

from infthor_eval.errors import ModelError
from model_adapters import load
from model_adapters.hf.cached.branch_attention import BranchAttention

from ...asking import up_to
from ...checkpoints import save_llava

CHUNKS = {"model_type": "llama4_text", "num_local_experts": 2, "no_rope_layers": [1, 0]}
STEADY = {**CHUNKS, "attn_temperature_tuning": False, "attention_chunk_size": 16}
QWEN = {
    "model_type": "qwen2_moe",
    "num_experts": 4,
    "num_experts_per_tok": 2,
    "moe_intermediate_size": 64,
    "shared_expert_intermediate_size": 64,
    "use_sliding_window": True,
    "sliding_window": 16,
    "max_window_layers": 1,
}
PHI = {"model_type": "phimoe", "num_local_experts": 2, "sliding_window": 16}
WINDOWED = {
    "llama4's chunks": STEADY,
    "qwen2_moe's window": QWEN,
    "phimoe's window": PHI,
    "mistral's window": {"model_type": "mistral", "sliding_window": 16},
}
QUESTIONS = (
    "\nOne.",
    "\nWhere was the mug?",
    "\nOr was it the plate on the table, which is larger than the window of the kitchen is wide?",
    "\nWhat is on the table and in the sink and in the fridge and on the shelf?",
    "\nWho?",
)


@pytest.fixture
def load_llava(tmp_path):
    """Saves a LLaVA with a language model of these settings, and loads it."""

    def load_saved(text, **options):
        torch.manual_seed(0)
        save_llava(tmp_path, **text)
        return load("hf-vlm", {"pretrained": str(tmp_path), "device": "cpu", **options}, seed=0)

    return load_saved


def _asked(model, frames, size):
    """Replies to all questions behind more tokens than a window has, so many at a time."""
    talk = model.conversation()
    talk.append(*frames[:2], "\nThe mug was put into the sink of the kitchen, then on a table.")
    replies = []
    for at in range(0, len(QUESTIONS), size):
        replies += talk.replies([[text] for text in QUESTIONS[at : at + size]], up_to(8))
    return [reply.token_ids for reply in replies]


@pytest.mark.parametrize("name", WINDOWED)
def test_what_a_layer_attends_to_is_asked_of_the_model(name, load_llava, frames):
    model = load_llava(WINDOWED[name], chunk_tokens="30")
    assert model.windows == {16}
    assert model.capabilities.batch_size == 64
    assert _asked(model, frames, 5) == _asked(model, frames, 1)


def test_a_model_that_counts_positions_by_its_cache_is_asked_one_by_one(load_llava, frames):
    model = load_llava({**STEADY, "attn_temperature_tuning": True, "floor_scale": 16})
    assert model.capabilities.batch_size == 1
    assert _asked(model, frames, 5) == _asked(model, frames, 1)


def test_a_model_that_adds_to_its_scores_is_asked_one_by_one(load_llava):
    model = load_llava({"model_type": "gemma2", "query_pre_attn_scalar": 32})
    assert model.capabilities.batch_size == 1
    # Whatever transformers would choose: torch's kernel does not cap scores.
    assert model.identity()["attn_implementation"] == "eager"


@pytest.mark.parametrize("size", [16, 4096])
@pytest.mark.parametrize("text", [STEADY, QWEN, PHI], ids=["llama4", "qwen2_moe", "phimoe"])
def test_masks_without_their_windows_are_found_when_a_checkpoint_is_loaded(
    text, size, load_llava, monkeypatch
):
    asked = BranchAttention._mask

    def ignore_windows(self, **settings):
        def sees(batch, head, at, other):
            return other <= at

        return asked(self, **settings | {"mask_function": sees})

    window = "attention_chunk_size" if text is STEADY else "sliding_window"
    settings = {**text, window: size}
    assert load_llava(settings).capabilities.batch_size == 64
    monkeypatch.setattr(BranchAttention, "_mask", ignore_windows)
    with pytest.raises(
        ModelError, match=r"in batches \(.*differ from those alone\); use batch_size=1$"
    ):
        load_llava(settings)
    model = load_llava(settings, batch_size="1")
    assert getattr(model.loaded.model.get_decoder().config, window) == size


def test_the_sample_leaves_windows_and_kernel_as_they_were(load_llava):
    model = load_llava({**PHI, "sliding_window": 4096})
    config = model.loaded.model.get_decoder().config
    assert (config.sliding_window, config._attn_implementation) == (4096, "sdpa")
    assert model.windows == {4096}
    assert model._prefix.n_tokens == 0
