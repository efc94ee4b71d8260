"""The keys of IPEC-COMMUNITY/spatialvla-4b-224-pt, written from its architecture as transformers
4.47 has it."""

import math
from collections import Counter

import msgspec
import pytest

from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.network import SpatialVLAWeights, checkpoint_key
from model_adapters.policies.weights import empty_parameters

from .published import CONFIG

BEIT = "vision_zoe_model.backbone.encoder.layer.23"
SIGLIP = "vision_tower.vision_model"

SHAPES = {
    "language_model.model.embed_tokens.weight": (265_347, 2304),
    "language_model.lm_head.weight": (265_347, 2304),
    "language_model.model.layers.25.self_attn.q_proj.weight": (2048, 2304),
    "language_model.model.layers.25.self_attn.k_proj.weight": (1024, 2304),
    "language_model.model.layers.0.pre_feedforward_layernorm.weight": (2304,),
    "language_model.model.layers.0.mlp.gate_proj.weight": (9216, 2304),
    "spatial_embed_tokens.weight": (8194, 2304),
    "multi_modal_projector.linear.weight": (2304, 1152),
    # 4 points, 3 axes, 17 numbers each.
    "position_embedding_3d.position_embedding_head.0.weight": (1152, 204),
    "position_embedding_3d.position_embedding_head.1.weight": (1152,),
    "position_embedding_3d.position_embedding_head.3.weight": (1152, 1152),
    f"{SIGLIP}.embeddings.patch_embedding.weight": (1152, 3, 14, 14),
    f"{SIGLIP}.embeddings.position_embedding.weight": (256, 1152),
    f"{SIGLIP}.encoder.layers.26.mlp.fc1.weight": (4304, 1152),
    f"{SIGLIP}.post_layernorm.weight": (1152,),
    "vision_zoe_model.backbone.embeddings.cls_token": (1, 1, 1024),
    "vision_zoe_model.backbone.embeddings.patch_embeddings.projection.weight": (1024, 3, 16, 16),
    f"{BEIT}.attention.attention.query.bias": (1024,),
    f"{BEIT}.attention.attention.key.weight": (1024, 1024),
    # A row for each of (2 * 24 - 1) ** 2 offsets, and three more.
    f"{BEIT}.attention.attention.relative_position_bias.relative_position_bias_table": (2212, 16),
    f"{BEIT}.attention.output.dense.weight": (1024, 1024),
    f"{BEIT}.intermediate.dense.weight": (4096, 1024),
    f"{BEIT}.output.dense.weight": (1024, 4096),
    f"{BEIT}.lambda_1": (1024,),
    f"{BEIT}.layernorm_after.bias": (1024,),
    "vision_zoe_model.neck.fusion_stage.layers.3.residual_layer2.convolution1.weight": (
        256,
        256,
        3,
        3,
    ),
    "vision_zoe_model.metric_head.seed_bin_regressors.kitti.conv2.weight": (64, 64, 1, 1),
}


def _layout(**text):
    config = msgspec.convert(
        CONFIG | {"text_config": CONFIG["text_config"] | text}, SpatialVLAConfig
    )
    with empty_parameters():
        return SpatialVLAWeights(config, "eager").layout()


@pytest.fixture(scope="module")
def layout():
    return _layout()


def test_names_and_shapes(layout):
    expected = layout.all_shapes()
    assert {key: expected.get(key) for key in SHAPES} == SHAPES


def test_how_many_there_are_of_each_part(layout):
    parts = Counter(key.split(".")[0] for key in layout.all_shapes())
    assert parts["language_model"] == 26 * 11 + 3
    assert parts["vision_tower"] == 27 * 16 + 5
    assert parts["position_embedding_3d"] == 6
    assert parts["multi_modal_projector"] == 2
    assert parts["spatial_embed_tokens"] == 1
    n_beit = sum(key.startswith("vision_zoe_model.backbone.") for key in layout.all_shapes())
    assert n_beit == 24 * 18 + 3
    assert len(layout.all_shapes()) == 1382


def test_it_is_a_model_of_four_billion(layout):
    assert sum(math.prod(shape) for shape in layout.all_shapes().values()) == pytest.approx(
        4.03e9, rel=0.005
    )


def test_nothing_is_unused_and_no_key_means_two_parameters(layout):
    assert not layout.unused
    assert len(set(layout.parameters.values())) == len(layout.parameters)


def test_no_name_of_transformers_5_is_expected_of_a_file(layout):
    new = ("backbone.beit.", "q_proj.", "o_proj.", ".layers.")
    beit = [key for key in layout.all_shapes() if key.startswith("vision_zoe_model.backbone.")]
    assert not [key for key in beit if any(part in key for part in new)]


def test_tied_embeddings_have_one_key():
    keys = _layout(tie_word_embeddings=True).all_shapes()
    assert "language_model.lm_head.weight" not in keys
    assert "language_model.model.embed_tokens.weight" in keys


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("vision_tower.post_layernorm.bias", "vision_tower.vision_model.post_layernorm.bias"),
        (
            "vision_tower.vision_model.post_layernorm.bias",
            "vision_tower.vision_model.post_layernorm.bias",
        ),
        (
            "vision_zoe_model.backbone.beit.layers.7.mlp.fc1.bias",
            "vision_zoe_model.backbone.encoder.layer.7.intermediate.dense.bias",
        ),
        (
            "vision_zoe_model.backbone.beit.layers.7.mlp.fc2.bias",
            "vision_zoe_model.backbone.encoder.layer.7.output.dense.bias",
        ),
        (
            "vision_zoe_model.backbone.beit.layers.0.relative_position_bias.relative_position_bias_table",
            "vision_zoe_model.backbone.encoder.layer.0.attention.attention.relative_position_bias.relative_position_bias_table",
        ),
        # ZoeDepth's own names did not change, whatever they look like.
        (
            "vision_zoe_model.metric_head.patch_transformer.transformer_encoder.0.self_attn.query.weight",
            "vision_zoe_model.metric_head.patch_transformer.transformer_encoder.0.self_attn.query.weight",
        ),
    ],
)
def test_names_and_keys(name, key):
    assert checkpoint_key(name) == key
