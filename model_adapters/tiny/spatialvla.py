"""A SpatialVLA of two layers with random weights and the action tokens of the real one."""

import math
from copy import deepcopy
from typing import Any

import msgspec
import numpy as np
from scipy.stats import norm
from tokenizers import Tokenizer

from model_adapters.options.policies import SpatialVLAOptions
from model_adapters.policies.spatialvla.adapter import MODEL_TYPE, load_spatialvla
from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.network import SpatialVLAWeights
from model_adapters.policies.weights import Layout, empty_parameters
from model_adapters.tiny.policy_twin import BRIDGE, PolicyTwin, TinyPolicyAdapter
from model_adapters.tiny.tokenizer import train_tokenizer

_N_MERGED = 600
_SPECIAL = ("<pad>", "<eos>", "<bos>", "<unk>", "<image>")
_N_ACTIONS = 8194
_BEGIN = _N_MERGED + len(_SPECIAL)  # id of the first action token; the image token precedes it
# number of bins, lowest and highest border, mean and deviation of the Gaussian with the borders as
# quantiles
_AXES = {
    "theta_bins": (16, 0.0, math.pi, 1.9, 0.7),
    "phi_bins": (32, -math.pi, math.pi, 0.1, 1.6),
    "r_bins": (8, 0.0, math.sqrt(3), 0.6, 0.5),
    "roll_bins": (16, -1.0, 1.0, 0.0, 0.5),
    "pitch_bins": (16, -1.0, 1.0, 0.0, 0.5),
    "yaw_bins": (16, -1.0, 1.0, 0.0, 0.5),
}
_TRANSLATION = ("theta_bins", "phi_bins", "r_bins")
_ROTATION = ("roll_bins", "pitch_bins", "yaw_bins")


def _borders(n_bins: int, low: float, high: float, mean: float, deviation: float) -> list[float]:
    gaussian = norm(mean, deviation)
    likelihood = np.linspace(float(gaussian.cdf(low)), float(gaussian.cdf(high)), n_bins + 1)
    return list(np.clip(gaussian.ppf(likelihood), low, high).tolist())


_TEXT: dict[str, Any] = {
    "model_type": "gemma2",
    "vocab_size": _BEGIN + _N_ACTIONS,
    "hidden_size": 64,
    "intermediate_size": 128,
    "num_hidden_layers": 2,
    "num_attention_heads": 4,
    "num_key_value_heads": 2,
    "head_dim": 16,
    "query_pre_attn_scalar": 16,
    "tie_word_embeddings": False,
    "hidden_act": "gelu_pytorch_tanh",
}


_ZOE: dict[str, Any] = {
    "model_type": "zoedepth",
    "backbone": None,
    "backbone_config": {
        "model_type": "beit",
        "image_size": 96,
        "patch_size": 16,
        "hidden_size": 32,
        "intermediate_size": 64,
        "num_hidden_layers": 4,
        "num_attention_heads": 2,
        "out_features": ["stage1", "stage2", "stage3", "stage4"],
        "reshape_hidden_states": False,
        "use_relative_position_bias": True,
    },
    "backbone_hidden_size": 32,
    "neck_hidden_sizes": [8, 8, 16, 16],
    "fusion_hidden_size": 16,
    "bottleneck_features": 16,
    "num_relative_features": 8,
    "bin_embedding_dim": 16,
    "num_attractors": [4, 2, 2, 1],
    "num_patch_transformer_layers": 4,  # transformers ignores this and runs four
    "patch_transformer_hidden_size": 128,
    "patch_transformer_intermediate_size": 32,
    "patch_transformer_num_attention_heads": 4,
    "bin_configurations": [
        {"name": "nyu", "n_bins": 16, "min_depth": 1e-3, "max_depth": 10.0},
        {"name": "kitti", "n_bins": 16, "min_depth": 1e-3, "max_depth": 80.0},
    ],
}


_CONFIG: dict[str, Any] = {
    "model_type": MODEL_TYPE,
    "architectures": ["SpatialVLAForConditionalGeneration"],
    "torch_dtype": "float32",
    "image_token_index": _BEGIN - 1,
    "action_token_begin_idx": _BEGIN,
    "spatial_token_num": _N_ACTIONS,
    "ego3d_patch_reso": 2,
    "n_freqs": 8,
    "projection_dim": 64,
    "use_spatial_token": True,
    "use_vision_zoe": True,
    "text_config": _TEXT,
    "vision_config": {
        "model_type": "siglip_vision_model",
        "hidden_size": 32,
        "intermediate_size": 64,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
        "image_size": 56,
        "patch_size": 14,
        "vision_use_head": False,
    },
    "vision_zoe_config": _ZOE,
}


def _processor() -> dict[str, Any]:
    counts = {name: axis[0] for name, axis in _AXES.items()}
    borders = {name: _borders(*axis) for name, axis in _AXES.items()}
    camera = {
        "width": 640,
        "height": 480,
        "intrinsic": [[623.588, 0, 319.501], [0, 623.588, 239.545], [0, 0, 1]],
    }
    return {
        "processor_class": "SpatialVLAProcessor",
        "action_chunk_size": 4,
        "action_config": {
            "distribution": "gaussian",
            "use_spherical": True,
            "num_bins": {
                "total": _N_ACTIONS,
                "gripper": 2,
                "translation": {name: counts[name] for name in _TRANSLATION},
                "rotation": {name: counts[name] for name in _ROTATION},
            },
        },
        "bin_policy": {
            "translation": {name: borders[name] for name in _TRANSLATION},
            "rotation": {name: borders[name] for name in _ROTATION},
        },
        "intrinsic_config": {"default": camera},
        "statistics": {"bridge_orig/1.0.0": BRIDGE},
    }


def _tokenizer() -> Tokenizer:
    actions = tuple(f"<ACTION{number:05d}>" for number in range(_N_ACTIONS))
    return train_tokenizer(
        (*_SPECIAL, *actions), end="<eos>", pad="<pad>", named={}, n_merged=_N_MERGED
    ).backend_tokenizer


def _layout() -> Layout:
    # transformers' configs may change nested ones.
    config = msgspec.convert(deepcopy(_CONFIG), SpatialVLAConfig)
    with empty_parameters():
        return SpatialVLAWeights(config, "eager").layout()


class SpatialVLATiny(TinyPolicyAdapter):
    """The adapter `spatialvla-tiny`."""

    Options = SpatialVLAOptions
    twin = PolicyTwin(
        files={"config.json": _CONFIG, "processor_config.json": _processor()},
        tokenizer=_tokenizer,
        layout=_layout,
        load=load_spatialvla,
    )
