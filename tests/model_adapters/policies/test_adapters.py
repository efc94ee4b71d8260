"""The adapters of published checkpoints and their tiny twins: what they do, and what they refuse to
load."""

import json

import pytest
import torch

from infthor_eval.errors import DataError, InfthorError, ModelError, UsageError
from model_adapters import FramePolicy, check_adapter, load, options_of

from ...helpers.refusals import read_one_line
from ..asking import load_saved
from .conftest import FAMILIES, json_edit, weights_edit

NAMES = ("openvla-tiny", "spatialvla-tiny")


@pytest.fixture(scope="module")
def tiny():
    return {name: load(name, {}, 0) for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_the_twins_keep_the_contract(name, tiny):
    assert isinstance(tiny[name], FramePolicy)
    check_adapter(tiny[name])
    check_adapter(tiny[name], frame_size=(320, 240))


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("constrained", [True, False])
def test_checkpoints_in_the_published_layout_keep_the_contract(
    family, constrained, policy_checkpoints
):
    check_adapter(load_saved(family, policy_checkpoints[family], constrained=constrained))


@pytest.mark.parametrize("name", NAMES)
def test_frame_and_instruction_both_change_the_action(name, tiny, plain_frames):
    black, white = plain_frames
    actions = []
    for frame, text in [(black, "lift"), (white, "lift"), (black, "close it"), (black, "lift")]:
        tiny[name].reset()
        actions.append(tiny[name].act(frame, text))
    assert len(set(actions)) == 3
    assert actions[0] == actions[3]


@pytest.mark.parametrize("name", NAMES)
def test_the_seed_makes_the_weights(name, tiny, plain_frames):
    other, same = load(name, {}, 1), load(name, {}, 0)
    for policy in (tiny[name], other, same):
        policy.reset()
    acted = [policy.act(plain_frames[0], "pick up the mug") for policy in (tiny[name], other, same)]
    assert acted[0] == acted[2] != acted[1]
    assert other.identity() != same.identity() == tiny[name].identity()


def test_chunks_of_spatialvla_are_four_steps_unless_they_are_averaged(
    policy_checkpoints, plain_frames
):
    folder = policy_checkpoints["spatialvla"]
    lengths = [
        len(load_saved("spatialvla", folder, **settings).act(plain_frames[0], "pick up the mug"))
        for settings in ({}, {"ensemble": "none"}, {"ensemble": "none", "execute": "3"})
    ]
    assert lengths == [1, 4, 3]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("dtype", ["bfloat16", "float16"])
def test_narrow_types_act_too(family, dtype, policy_checkpoints, plain_frames):
    policy = load_saved(family, policy_checkpoints[family], dtype=dtype)
    assert policy.identity()["dtype"] == dtype
    assert policy.act(plain_frames[1], "pick up the mug")


@pytest.mark.parametrize("family", FAMILIES)
def test_the_checkpoint_s_own_type_is_taken(family, altered):
    folder = altered(
        family, json_edit("config.json", lambda config: config.update(torch_dtype="bfloat16"))
    )
    assert load_saved(family, folder).identity()["dtype"] == "bfloat16"


def test_tied_embeddings_are_written_by_what_they_are_read_by(altered):
    def tie(folder):
        json_edit(
            "config.json", lambda config: config["text_config"].update(tie_word_embeddings=True)
        )(folder)
        weights_edit(
            lambda weights: {key: value for key, value in weights.items() if "lm_head" not in key}
        )(folder)

    policy = load_saved("spatialvla", altered("spatialvla", tie))
    model = policy._network.weights.language_model
    assert model.lm_head.weight is model.model.embed_tokens.weight
    check_adapter(policy)


def test_the_published_checkpoints_are_the_defaults():
    openvla, spatialvla = (
        {name: declared.default for name, declared in options_of(model).items()}
        for model in ("openvla", "spatialvla")
    )
    assert openvla["pretrained"] == "openvla/openvla-7b"
    assert spatialvla["pretrained"] == "IPEC-COMMUNITY/spatialvla-4b-224-pt"
    assert (openvla["ensemble"], spatialvla["ensemble"]) == ("none", "exp")
    assert spatialvla["attn_implementation"] == "eager"


KEYS = {
    "openvla": (
        "vision_backbone.featurizer.blocks.0.attn.qkv.weight",
        "vision_backbone.fused_featurizer.attn_pool.latent",
    ),
    "spatialvla": (
        "vision_zoe_model.backbone.encoder.layer.3.attention.attention.query.weight",
        "vision_zoe_model.neck.reassemble_stage.layers.0.resize.weight",
    ),
}


@pytest.mark.parametrize(
    ("family", "key"), [(family, key) for family in FAMILIES for key in KEYS[family]]
)
def test_a_missing_key_ends_the_loading(family, key, altered):
    folder = altered(
        family,
        weights_edit(
            lambda weights: {name: value for name, value in weights.items() if name != key}
        ),
    )
    with pytest.raises(ModelError, match=f"the checkpoint lacks {key}"):
        load_saved(family, folder)


@pytest.mark.parametrize("family", FAMILIES)
def test_an_unknown_key_or_another_shape_ends_the_loading(family, altered):
    def change(weights):
        return weights | {"action_head.weight": torch.zeros(1), KEYS[family][0]: torch.zeros(2)}

    with pytest.raises(
        ModelError,
        match=rf"unknown action_head\.weight; has another shape in {KEYS[family][0]} \[2\]",
    ):
        load_saved(family, altered(family, weights_edit(change)))


def test_a_depth_model_under_its_new_names_is_no_checkpoint_of_ours(altered):
    def renamed(weights):
        return {
            name.replace("backbone.encoder.layer.", "backbone.beit.layers."): value
            for name, value in weights.items()
        }

    with pytest.raises(
        ModelError, match=r"lacks vision_zoe_model\.backbone\.encoder.*; has unknown vision_zoe"
    ):
        load_saved("spatialvla", altered("spatialvla", weights_edit(renamed)))


@pytest.mark.parametrize(("family", "other"), [FAMILIES, FAMILIES[::-1]])
def test_a_checkpoint_of_another_family_is_named(family, other, policy_checkpoints):
    with pytest.raises(ModelError, match=f"is a {other} checkpoint, not {family}"):
        load_saved(family, policy_checkpoints[other])


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda folder: (folder / "model.safetensors").unlink(), "no *.safetensors"),
        (lambda folder: (folder / "model.safetensors").write_bytes(b"cut"), "cannot be loaded"),
        (lambda folder: (folder / "tokenizer.json").unlink(), "tokenizer.json"),
        (lambda folder: (folder / "tokenizer.json").write_text("{}"), "cannot be loaded"),
        (
            lambda folder: (folder / "config.json").write_text("{"),
            "config.json: not in its documented form",
        ),
        (lambda folder: (folder / "config.json").unlink(), "config.json"),
        (
            json_edit("config.json", lambda config: config.update(model_type="llava")),
            "a llava checkpoint",
        ),
        (
            json_edit("config.json", lambda config: config.update(text_config=3)),
            "not in its documented form",
        ),
        (
            json_edit("config.json", lambda config: config.update(torch_dtype="int8")),
            "has no type of weights",
        ),
        (
            json_edit("config.json", lambda config: config.pop("torch_dtype")),
            "has no type of weights; give dtype=",
        ),
    ],
)
def test_a_damaged_checkpoint_is_one_line(family, edit, message, altered):
    with pytest.raises(InfthorError) as caught:
        load_saved(family, altered(family, edit))
    assert message in read_one_line(caught)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("family", "name", "place", "key"),
    [
        ("openvla", "config.json", "norm_stats", "bridge_orig"),
        ("spatialvla", "processor_config.json", "statistics", "bridge_orig/1.0.0"),
    ],
)
def test_the_dataset_is_chosen_by_its_key(family, name, place, key, altered, plain_frames):
    still = {"q01": [0.0] * 7, "q99": [0.0] * 7, "mask": [True] * 6 + [False]}
    folder = altered(
        family, json_edit(name, lambda content: content[place].update(still={"action": still}))
    )
    with pytest.raises(UsageError, match=f"choose one with unnorm_key= of {key}, still"):
        load_saved(family, folder)
    with pytest.raises(
        UsageError, match=f"unnorm_key=bridge is not a dataset of .*; there are {key}, still"
    ):
        load_saved(family, folder, unnorm_key="bridge")
    policy = load_saved(family, folder, unnorm_key="still")
    assert policy.identity()["unnorm_key"] == "still"
    assert {step.translation for step in policy.act(plain_frames[0], "pick up the mug")} == {
        (0.0, 0.0, 0.0)
    }


def test_statistics_of_a_fine_tuned_openvla_are_in_a_file_of_their_own(altered):
    action = {"q01": [0.0] * 7, "q99": [1.0] * 7}
    content = json.dumps({"kitchen": {"action": action}})
    folder = altered(
        "openvla", lambda folder: (folder / "dataset_statistics.json").write_text(content)
    )
    assert load_saved("openvla", folder).identity()["unnorm_key"] == "kitchen"


@pytest.mark.parametrize(
    ("family", "file", "change", "message"),
    [
        (
            "openvla",
            "config.json",
            {"timm_model_ids": ["vit_tiny", "vit_small"]},
            "has the vision towers",
        ),
        (
            "openvla",
            "config.json",
            {"image_resize_strategy": "letterbox"},
            "only the preprocessing of openvla",
        ),
        ("openvla", "config.json", {"image_sizes": [56, 70]}, "only the preprocessing of openvla"),
        (
            "openvla",
            "config.json",
            {"timm_override_act_layers": ["quick_gelu", None]},
            "only the preprocessing",
        ),
        (
            "spatialvla",
            "config.json",
            {"use_vision_zoe": False},
            "only SpatialVLA with use_spatial_token",
        ),
        (
            "spatialvla",
            "config.json",
            {"action_token_begin_idx": 600},
            "actions begin at 600 in the config and at 605",
        ),
        (
            "spatialvla",
            "config.json",
            {"spatial_token_num": 8190},
            "has 8190 action tokens and 8194 bins",
        ),
        ("spatialvla", "processor_config.json", {"intrinsic_config": {}}, "has no intrinsics"),
        ("spatialvla", "processor_config.json", {"bin_policy": {}}, "not in its documented form"),
    ],
)
def test_a_variant_that_is_not_run_here_is_refused(family, file, change, message, altered):
    with pytest.raises((ModelError, DataError), match=message):
        load_saved(family, altered(family, json_edit(file, lambda content: content.update(change))))


def test_a_tokenizer_that_begins_no_text_is_refused(altered):
    folder = altered(
        "openvla", json_edit("tokenizer.json", lambda content: content.update(post_processor=None))
    )
    with pytest.raises(ModelError, match="the tokenizer does not begin a text with <s>"):
        load_saved("openvla", folder)


@pytest.mark.parametrize("family", FAMILIES)
def test_weights_that_are_no_numbers_are_refused_when_it_acts(family, altered, plain_frames):
    key = "language_model.lm_head.weight"
    folder = altered(
        family, weights_edit(lambda weights: weights | {key: weights[key] * torch.nan})
    )
    with pytest.raises(ModelError, match="action token 1 has no finite score"):
        load_saved(family, folder).act(plain_frames[0], "pick up the mug")


@pytest.mark.parametrize("name", ["openvla", "spatialvla"])
def test_misuse_is_refused_before_anything_is_looked_for(name):
    with pytest.raises(UsageError, match="ensemble=mean: give none or exp"):
        load(name, {"ensemble": "mean"}, 0)
    with pytest.raises(ModelError, match="there is no such folder"):
        load(name, {"pretrained": "/nowhere/at/all"}, 0)


def test_attention_that_cannot_read_in_both_directions_is_refused():
    with pytest.raises(UsageError, match="attn_implementation=flex_attention: give eager or sdpa"):
        load("spatialvla-tiny", {"attn_implementation": "flex_attention"}, 0)
