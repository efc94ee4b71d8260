"""Context extension: what lands in the config, and that chunks and cached prefixes see the
frequencies of one pass."""

import math
from importlib import import_module
from itertools import combinations

import pytest
import torch
from transformers import LlamaConfig, Qwen2Config
from transformers.modeling_rope_utils import ROPE_INIT_FUNCTIONS

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters import load
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.loading.checkpoint import assemble
from model_adapters.hf.loading.rope import apply_rope
from model_adapters.hf.prompting.prompt import token_ids
from model_adapters.options.checkpoints import HfOptions

from ...asking import up_to, user

ORIGINAL = 64
ROPES = ["linear:2", "dynamic:4", "yarn:4", "longrope:8", "longrope-scaled:8"]
TWINS = {"qwen2_5_vl": "Qwen25VLTiny", "pixtral": "PixtralTiny"}  # multimodal and plain RoPE


def _twin(name):
    return getattr(import_module(f"model_adapters.tiny.{name}"), TWINS[name]).twin


def _model(name, rope, **options):
    """Ours with an extension, and transformers' own model with the same config and weights."""
    twin = _twin(name)
    tokenizer = twin.tokenizer()
    models = []
    for _ in range(2):
        config = twin.model_config(tokenizer)
        config.get_text_config().max_position_embeddings = ORIGINAL
        limit = apply_rope(config, rope)
        models.append(twin.model(tokenizer, config, 0, "sdpa").eval())
    image_processor = twin.image_processor(**twin.image_settings)
    family = twin.family(models[0], image_processor, tokenizer)
    loaded = assemble(
        models[0],
        tokenizer,
        image_processor,
        template=twin.template,
        family=family,
        max_tokens=limit,
        origin={},
    )
    return TransformersModel(name, loaded, HfOptions(max_tokens=0, rope=rope, **options)), models[1]


def _plain_logits(model, peer, parts):
    """One forward pass of transformers' own model over the whole prompt, pixels and all."""
    ids = torch.tensor([list(token_ids(model.pieces(user(*parts))))])
    processor = model._loaded.family._image_processor
    images = [part.load() for part in parts if isinstance(part, FrameRef)]
    inputs = dict(processor(images=images, return_tensors="pt"))
    if hasattr(peer.model, "get_rope_index"):
        inputs["mm_token_type_ids"] = (ids == peer.config.image_token_id).int()
    with torch.inference_mode():
        return peer(input_ids=ids, **inputs).logits[0, -1]


@pytest.mark.parametrize("rope", ROPES)
@pytest.mark.parametrize("name", TWINS)
def test_chunks_and_prefixes_see_the_frequencies_of_one_pass(name, rope, frames):
    model, peer = _model(name, rope, chunk_tokens=20)
    short = [frames[0], "?"]
    long = [*frames, *frames, "RotateLeft " * 30, "\nWhere?"]
    longer = [*long[:-1], "MoveAhead " * 5, "\nWhere is it?"]
    for parts in (long, longer, short, long):
        pieces = model.pieces(user(*parts))
        shared = model._prefix.rewind_to(pieces)
        logits = model._prefix.feed(pieces[shared:])
        torch.testing.assert_close(logits, _plain_logits(model, peer, parts), atol=1e-3, rtol=1e-3)


@pytest.mark.parametrize(
    ("rope", "shares"), [("yarn:4", True), ("longrope:4", True), ("dynamic:4", False)]
)
def test_prefixes_are_shared_where_frequencies_are_equal(rope, shares, frames):
    model, _ = _model("qwen2_5_vl", rope)
    talk = model.conversation()
    talk.append(*frames, "RotateLeft " * 40)
    start = talk.mark()
    cached = []
    for question in ("What?", "Where was the mug?"):
        talk.append(question)
        cached.append(talk.reply(up_to(2)).n_cached_tokens)
        talk.rewind(start)
    assert (cached[1] > 50) is shares


@pytest.mark.parametrize("rope", ROPES)
def test_an_extension_changes_long_prompts(rope, frames):
    parts = [*frames, "RotateLeft " * 40]
    logits = []
    for each in (None, rope):
        model, _ = _model("qwen2_5_vl", each)
        logits.append(model.encode(model.pieces(user(*parts))))
    assert (logits[0] - logits[1]).abs().max() > 1e-2


def test_yarn_is_written_as_transformers_wants_it():
    config = _twin("qwen2_5_vl").model_config(_twin("qwen2_5_vl").tokenizer())
    assert apply_rope(config, "yarn:4") == 4 * 128_000
    assert config.text_config.rope_parameters == {
        "rope_type": "yarn",
        "rope_theta": 1e6,
        "factor": 4.0,
        "original_max_position_embeddings": 128_000,
        "mrope_section": [4, 6, 6],
    }


def test_yarn_scales_attention_by_its_own_rule():
    _, peer = _model("qwen2_5_vl", "yarn:4")
    rotary = peer.model.language_model.rotary_emb
    assert rotary.rope_type == "yarn"
    assert rotary.attention_scaling == pytest.approx(0.1 * math.log(4) + 1)


def _logits(rope, parts):
    model, _ = _model("qwen2_5_vl", rope)
    return model.encode(model.pieces(user(*parts)))


def test_the_published_longrope_is_plain_within_the_original_length(frames):
    short = [frames[0], "Where?"]
    plain = _logits(None, short)
    assert torch.equal(_logits("longrope:4", short), plain)
    assert not torch.allclose(_logits("longrope-scaled:4", short), plain, atol=1e-4)


def test_the_forms_of_longrope_differ_beyond_the_original_length_too(frames):
    long = [*frames, "RotateLeft " * 40]
    published, scaled, plain = (
        _logits(rope, long) for rope in ("longrope:4", "longrope-scaled:4", None)
    )
    for one, other in combinations((published, scaled, plain), 2):
        assert not torch.allclose(one, other, atol=1e-4)


def test_longrope_is_what_the_published_scripts_ask_for():
    config = Qwen2Config(hidden_size=64, num_attention_heads=4, max_position_embeddings=100)
    published = {
        "long_factor": 4.0,
        "short_factor": 1,
        "factor": 1.0,
        "original_max_position_embeddings": 100,
    }
    theirs = Qwen2Config(hidden_size=64, num_attention_heads=4, max_position_embeddings=100)
    theirs.rope_parameters = {**config.rope_parameters, "rope_type": "longrope", **published}
    assert apply_rope(config, "longrope:4") == 400
    compute = ROPE_INIT_FUNCTIONS["longrope"]
    for length in (100, 101):
        (ours, our_scale), (wanted, scale) = (
            compute(each, "cpu", seq_len=length) for each in (config, theirs)
        )
        assert torch.equal(ours, wanted)
        assert our_scale == scale == 1.0


def test_scaled_longrope_scales_attention_by_its_authors_rule():
    _, peer = _model("qwen2_5_vl", "longrope-scaled:4")
    scaling = math.sqrt(1 + math.log(4) / math.log(ORIGINAL))
    assert peer.model.language_model.rotary_emb.attention_scaling == pytest.approx(scaling)


@pytest.mark.parametrize(("rope", "long_factor"), [("longrope-scaled:4", 2.0), ("longrope:4", 4.0)])
def test_only_scaled_longrope_takes_the_checkpoints_own_factors(rope, long_factor):
    config = Qwen2Config(hidden_size=64, num_attention_heads=4, max_position_embeddings=100)
    config.rope_parameters = {
        "rope_type": "longrope",
        "rope_theta": 1e4,
        "short_factor": [1.0] * 8,
        "long_factor": [2.0] * 8,
    }
    apply_rope(config, rope)
    assert config.rope_parameters["long_factor"] == [long_factor] * 8


def test_without_extension_nothing_changes():
    config = LlamaConfig(max_position_embeddings=100)
    before = dict(config.rope_parameters)
    assert apply_rope(config, None) == 100
    assert config.rope_parameters == before


def test_a_model_with_several_ropes_is_refused():
    config = LlamaConfig(max_position_embeddings=100)
    config.rope_parameters = {
        "full_attention": {"rope_theta": 1e4},
        "sliding_attention": {"rope_theta": 1e6},
    }
    with pytest.raises(ModelError, match="no single RoPE"):
        apply_rope(config, "yarn:4")


@pytest.mark.parametrize(
    "rope", ["yarn", "yarn:x", "yarn:1", "yarn:-2", "other:4", "yarn:nan", "yarn:inf", ":4"]
)
def test_a_malformed_extension_is_a_usage_error(rope):
    with pytest.raises(UsageError, match=f"rope={rope} is not TYPE:FACTOR"):
        load("qwen2.5-vl-tiny", {"rope": rope}, seed=0)


def test_limit_and_identity_tell_the_extension():
    plain, extended = (
        load("qwen2.5-vl-tiny", options, seed=0) for options in ({}, {"rope": "yarn:4"})
    )
    assert (plain.capabilities.max_tokens, extended.capabilities.max_tokens) == (128_000, 512_000)
    assert extended.capabilities.max_tokens_before_extension == 128_000
    assert plain.capabilities.max_tokens_before_extension is None
    assert plain.identity() != extended.identity()
    assert extended.identity()["rope"]["factor"] == 4.0
    forms = [
        load("qwen2.5-vl-tiny", {"rope": rope}, seed=0).identity()
        for rope in ("longrope:4", "longrope-scaled:4")
    ]
    assert forms[0] != forms[1]
