"""The keys of openvla/openvla-7b, written from its architecture.

Names and shapes of the towers are those of timm 0.9.16's vit_large_patch14_reg4_dinov2 and
vit_so400m_patch14_siglip_224 with `gamma` called `scale_factor`; those of the language model are
transformers'.
"""

import math
import re
from collections import Counter

import pytest
from transformers import LlamaConfig

from model_adapters.policies.openvla.network import OpenVLAWeights, weights_layout
from model_adapters.policies.openvla.vision import TOWERS
from model_adapters.policies.weights import empty_parameters

DINO, SIGLIP, LLAMA = (
    "vision_backbone.featurizer",
    "vision_backbone.fused_featurizer",
    "language_model.model",
)

SHAPES = {
    "language_model.lm_head.weight": (32_064, 4096),
    f"{LLAMA}.embed_tokens.weight": (32_064, 4096),
    f"{LLAMA}.norm.weight": (4096,),
    f"{LLAMA}.layers.31.self_attn.q_proj.weight": (4096, 4096),
    f"{LLAMA}.layers.31.mlp.down_proj.weight": (4096, 11_008),
    f"{LLAMA}.layers.0.input_layernorm.weight": (4096,),
    "projector.fc1.weight": (8704, 2176),
    "projector.fc1.bias": (8704,),
    "projector.fc2.weight": (4096, 8704),
    "projector.fc3.weight": (4096, 4096),
    f"{DINO}.cls_token": (1, 1, 1024),
    f"{DINO}.reg_token": (1, 4, 1024),
    f"{DINO}.pos_embed": (1, 256, 1024),  # of the patches alone
    f"{DINO}.patch_embed.proj.weight": (1024, 3, 14, 14),
    f"{DINO}.blocks.0.attn.qkv.weight": (3072, 1024),
    f"{DINO}.blocks.22.ls2.scale_factor": (1024,),
    f"{DINO}.blocks.23.ls1.scale_factor": (1024,),
    f"{DINO}.blocks.23.mlp.fc1.weight": (4096, 1024),
    f"{DINO}.norm.bias": (1024,),
    f"{SIGLIP}.pos_embed": (1, 256, 1152),
    f"{SIGLIP}.patch_embed.proj.bias": (1152,),
    f"{SIGLIP}.blocks.26.mlp.fc1.weight": (4304, 1152),
    f"{SIGLIP}.blocks.25.attn.qkv.bias": (3456,),
    f"{SIGLIP}.norm.weight": (1152,),
    f"{SIGLIP}.attn_pool.latent": (1, 1, 1152),
    f"{SIGLIP}.attn_pool.kv.weight": (2304, 1152),
    f"{SIGLIP}.attn_pool.mlp.fc2.weight": (1152, 4304),
}


@pytest.fixture(scope="module")
def layout():
    towers = tuple(TOWERS.values())
    with empty_parameters():
        weights = OpenVLAWeights(towers, 224, LlamaConfig(vocab_size=32_064, pad_token_id=32_000))
    return weights_layout(weights, towers)


def test_names_and_shapes(layout):
    expected = layout.all_shapes()
    assert {key: expected.get(key) for key in SHAPES} == SHAPES


def test_how_many_there_are_of_each_part(layout):
    expected = layout.all_shapes()
    parts = Counter(".".join(key.split(".")[:2]) for key in expected)
    # 14 a block and 7 beside them; 12 a block and 18 beside them; 9 a layer and embeddings, norm
    # and head
    assert parts[DINO] == 24 * 14 + 7
    assert parts[SIGLIP] == 27 * 12 + 18
    assert sum(key.startswith("language_model.") for key in expected) == 32 * 9 + 3
    assert sum(key.startswith("projector.") for key in expected) == 6
    assert len(expected) == 982


def test_no_parameter_is_known_by_two_names(layout):
    assert not layout.parameters.keys() & layout.unused.keys()
    assert all(key == name for key, name in layout.parameters.items())


def test_what_no_feature_depends_on_is_known_not_ignored(layout):
    unused = Counter(re.sub(r"blocks\.(\d+)\..*", r"blocks.\1", key) for key in layout.unused)
    assert unused[f"{DINO}.blocks.23"] == 14
    assert unused[f"{SIGLIP}.blocks.26"] == 12
    rest = {key for key in unused if ".blocks." not in key}
    pool = {
        "latent",
        *(
            f"{part}.{kind}"
            for part in ("q", "kv", "proj", "norm", "mlp.fc1", "mlp.fc2")
            for kind in ("weight", "bias")
        ),
    }
    norms = {f"{tower}.norm.{kind}" for tower in (DINO, SIGLIP) for kind in ("weight", "bias")}
    assert rest == norms | {f"{SIGLIP}.attn_pool.{name}" for name in pool}
    assert len(layout.unused) == 14 + 12 + 4 + 13


def test_it_is_a_model_of_seven_billion(layout):
    n_weights = sum(map(math.prod, layout.all_shapes().values()))
    assert n_weights == pytest.approx(7.54e9, rel=0.002)


def test_the_defaults_that_the_published_config_leaves_out_are_llama_2_s():
    config = LlamaConfig()
    sizes = (
        config.hidden_size,
        config.intermediate_size,
        config.num_hidden_layers,
        config.num_attention_heads,
    )
    assert sizes == (4096, 11_008, 32, 32)
    assert config.num_key_value_heads == 32
    assert config.rope_parameters["rope_theta"] == 10_000.0
    assert (config.hidden_act, config.attention_bias, config.tie_word_embeddings) == (
        "silu",
        False,
        False,
    )
