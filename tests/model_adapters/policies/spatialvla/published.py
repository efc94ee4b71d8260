"""What IPEC-COMMUNITY's SpatialVLA checkpoints say of themselves, as far as tests need it."""

from typing import Any

__all__ = ["BINS", "CONFIG"]

CONFIG: dict[str, Any] = {
    "image_token_index": 257_152,
    "action_token_begin_idx": 257_153,
    "spatial_token_num": 8194,
    "ego3d_patch_reso": 2,
    "n_freqs": 8,
    "projection_dim": 2304,
    "text_config": {
        "model_type": "gemma2",
        "hidden_size": 2304,
        "intermediate_size": 9216,
        "num_hidden_layers": 26,
        "num_key_value_heads": 4,
        "hidden_act": "gelu_pytorch_tanh",
        "tie_word_embeddings": False,
        "vocab_size": 265_347,
    },
    "vision_config": {
        "model_type": "siglip_vision_model",
        "hidden_size": 1152,
        "intermediate_size": 4304,
        "num_attention_heads": 16,
        "num_hidden_layers": 27,
        "patch_size": 14,
        "projection_dim": 2304,
        "vision_use_head": False,
    },
    "vision_zoe_config": {
        "model_type": "zoedepth",
        "backbone": None,
        "backbone_config": {
            "model_type": "beit",
            "hidden_size": 1024,
            "image_size": 384,
            "intermediate_size": 4096,
            "num_attention_heads": 16,
            "num_hidden_layers": 24,
            "out_features": ["stage6", "stage12", "stage18", "stage24"],
            "reshape_hidden_states": False,
            "use_relative_position_bias": True,
        },
        "bin_configurations": [
            {"max_depth": 10.0, "min_depth": 0.001, "n_bins": 64, "name": "nyu"},
            {"max_depth": 80.0, "min_depth": 0.001, "n_bins": 64, "name": "kitti"},
        ],
        "bin_embedding_dim": 128,
        "neck_hidden_sizes": [256, 512, 1024, 1024],
        "num_attractors": [16, 8, 4, 1],
        "num_patch_transformer_layers": 4,
        "patch_transformer_hidden_size": 128,
        "patch_transformer_intermediate_size": 1024,
        "patch_transformer_num_attention_heads": 4,
    },
}

# Borders of the bins of spatialvla-4b-mix-224-pt, to four digits.
_BORDERS = {
    "theta": """
        0 0.7067 0.9814 1.1752 1.3331 1.4713 1.5978 1.7173 1.8331 1.948 2.0645 2.1854 2.3142
        2.4563 2.621 2.8284 3.1416
    """,
    "phi": """
        -3.1416 -2.5598 -2.19 -1.9071 -1.6724 -1.4683 -1.2853 -1.1177 -0.9615 -0.8141
        -0.6736 -0.5384 -0.4073 -0.2794 -0.1537 -0.0294 0.094 0.2173 0.3412 0.4664 0.5935
        0.7235 0.8573 0.9959 1.1409 1.294 1.4577 1.6353 1.8318 2.0554 2.3201 2.6552 3.1416
    """,
    "r": """
        0 0.1968 0.3506 0.4882 0.622 0.7621 0.9228 1.1393 1.7321
    """,
    "roll": """
        -1 -0.7121 -0.5565 -0.4401 -0.3426 -0.256 -0.1757 -0.099 -0.0241 0.051 0.1279 0.2087
        0.2962 0.3951 0.5142 0.6762 1
    """,
    "pitch": """
        -1 -0.6785 -0.5168 -0.3979 -0.2991 -0.2116 -0.1308 -0.0539 0.0211 0.0961 0.1728
        0.2531 0.3399 0.4374 0.5539 0.71 1
    """,
    "yaw": """
        -1 -0.691 -0.5314 -0.4133 -0.315 -0.2278 -0.1472 -0.0703 0.0047 0.0798 0.1565 0.237
        0.3241 0.4221 0.5397 0.698 1
    """,
}
BINS = {axis: tuple(map(float, numbers.split())) for axis, numbers in _BORDERS.items()}
