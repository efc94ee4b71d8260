"""An OpenVLA of two layers with random weights and the vocabulary of the real one."""

from typing import Any

import msgspec
from tokenizers import Tokenizer

from model_adapters.options.policies import OpenVLATinyOptions
from model_adapters.policies.openvla.adapter import MODEL_TYPE, load_openvla
from model_adapters.policies.openvla.config import OpenVLAConfig
from model_adapters.policies.openvla.network import OpenVLAWeights, weights_layout
from model_adapters.policies.openvla.vision import TOWERS, TowerShape
from model_adapters.policies.weights import Layout, empty_parameters
from model_adapters.tiny.policy_twin import BRIDGE, PolicyTwin, TinyPolicyAdapter
from model_adapters.tiny.tokenizer import train_tokenizer

_TOWERS = (TowerShape("dinov2", 32, 3, 2, 64), TowerShape("siglip", 48, 3, 2, 80))
_IMAGE_SIZE = 56


_CONFIG: dict[str, Any] = {
    "model_type": MODEL_TYPE,
    "architectures": ["OpenVLAForActionPrediction"],
    "torch_dtype": "float32",
    "timm_model_ids": list(TOWERS),
    "timm_override_act_layers": [None, None],
    "image_sizes": [_IMAGE_SIZE, _IMAGE_SIZE],
    "image_resize_strategy": "resize-naive",
    "use_fused_vision_backbone": True,
    "n_action_bins": 256,
    "pad_to_multiple_of": 64,
    "norm_stats": {"bridge_orig": BRIDGE},
    "vision_towers": [msgspec.to_builtins(tower) for tower in _TOWERS],
    "text_config": {
        "model_type": "llama",
        # gives action ids and Llama's token of a space their published numbers
        "vocab_size": 32_064,
        "hidden_size": 64,
        "intermediate_size": 128,
        "num_hidden_layers": 2,
        "num_attention_heads": 4,
        "num_key_value_heads": 4,
        "pad_token_id": 32_000,
    },
}


_TOKENIZER = {
    "tokenizer_class": "PreTrainedTokenizerFast",
    "bos_token": "<s>",
    "eos_token": "</s>",
    "unk_token": "<unk>",
    "pad_token": "</s>",
}


def _tokenizer() -> Tokenizer:
    special = ("<unk>", "<s>", "</s>")
    return train_tokenizer(special, begin="<s>", end="</s>", pad="</s>", named={}).backend_tokenizer


def _layout() -> Layout:
    config = msgspec.convert(_CONFIG, OpenVLAConfig)
    with empty_parameters():
        weights = OpenVLAWeights(_TOWERS, _IMAGE_SIZE, config.language("sdpa"))
    return weights_layout(weights, _TOWERS)


class OpenVLATiny(TinyPolicyAdapter):
    """The adapter `openvla-tiny`."""

    Options = OpenVLATinyOptions
    twin = PolicyTwin(
        files={"config.json": _CONFIG, "tokenizer_config.json": _TOKENIZER},
        tokenizer=_tokenizer,
        layout=_layout,
        load=load_openvla,
    )
