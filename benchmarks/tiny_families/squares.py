"""Families whose towers take images of one size."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from model_adapters.tiny.twin import HEAD, HIDDEN
from tiny_families.chats import GEMMA3, MISTRAL, VICUNA, Chat
from tiny_families.checkpoint import Family, Vocabulary
from tiny_families.parts import (
    PATCH,
    PINPOINTS,
    SIDE,
    SLIDING,
    SQUARE,
    siglip,
    tower,
)

__all__ = ["SQUARES"]


def _clip() -> dict[str, Any]:
    # Three layers, of which LLaVA reads the last but one.
    return tower("clip_vision_model", num_hidden_layers=3, initializer_factor=10.0)


def _clip_images(kind: str, **settings: Any) -> dict[str, Any]:
    return {
        "image_processor_type": f"{kind}ImageProcessor",
        "size": {"shortest_edge": SIDE},
        "crop_size": SQUARE,
        **settings,
    }


_LLAVA_PROCESSOR = {
    "patch_size": PATCH,
    "vision_feature_select_strategy": "default",
    "num_additional_image_tokens": 1,
    "image_token": "<image>",
}


def _llava(
    name: str, images: Mapping[str, Any], chat: Chat = VICUNA, text: str = "llama", **settings: Any
) -> Family:
    def config(vocabulary: Vocabulary) -> dict[str, Any]:
        return {
            "image_token_index": vocabulary["<image>"],
            "vision_config": _clip(),
            "text_config": vocabulary.text(text),
            **settings,
        }

    return Family(
        chat=chat,
        image="<image>\n",
        named={"image_token": "<image>"},
        config=config,
        images=images,
        processor={"processor_class": f"{name}Processor", **_LLAVA_PROCESSOR},
    )


def _deepseek_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<image_placeholder>"],
        "tie_word_embeddings": False,
        "vision_config": siglip(),
        "text_config": vocabulary.text("llama"),
    }


_DEEPSEEK_CHAT = Chat(
    special=("<｜begin▁of▁sentence｜>", "<｜end▁of▁sentence｜>"),
    begin="<｜begin▁of▁sentence｜>",
    end="<｜end▁of▁sentence｜>",
    pad="<｜end▁of▁sentence｜>",
    start="You are a helpful language and vision assistant.\n\n",
    heads={"user": "User: ", "assistant": "Assistant: "},
    tails={"system": "\n\n", "user": "\n\n", "assistant": "<｜end▁of▁sentence｜>"},
    prompt="Assistant:",
)


def _janus_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<image_placeholder>"],
        "vision_config": tower(
            projection_dim=HIDDEN, mlp_ratio=2.0, num_image_tokens=16, intermediate_size=64
        ),
        "text_config": vocabulary.text("llama"),
        "vq_config": {
            "base_channels": 32,
            "channel_multiplier": [1, 1],
            "latent_channels": 32,
            "num_res_blocks": 1,
            "num_embeddings": 16,
            "projection_dim": HIDDEN,
            "image_token_embed_dim": HIDDEN,
        },
    }


def _gemma3_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_index": vocabulary["<image_soft_token>"],
        "boi_token_index": vocabulary["<start_of_image>"],
        "eoi_token_index": vocabulary["<end_of_image>"],
        "mm_tokens_per_image": 4,
        "vision_config": siglip(),
        "text_config": vocabulary.text(query_pre_attn_scalar=HEAD, **SLIDING),
    }


def _paligemma_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_index": vocabulary["<image>"],
        "projection_dim": HIDDEN,
        "hidden_size": HIDDEN,
        "vision_config": siglip(projection_dim=HIDDEN),
        "text_config": vocabulary.text("gemma"),
    }


SQUARES = {
    "llava": _llava("Llava", _clip_images("CLIP")),
    "llava_next": _llava(
        "LlavaNext",
        _clip_images("LlavaNext", image_grid_pinpoints=PINPOINTS),
        replace(MISTRAL, images_first=True),
        "mistral",
        image_grid_pinpoints=PINPOINTS,
    ),
    "vipllava": _llava(
        "Llava",
        _clip_images("CLIP"),
        replace(
            VICUNA,
            heads={"user": "###Human: ", "assistant": "###Assistant: "},
            prompt="###Assistant:",
        ),
        vision_feature_layers=[-2, -1, 1],
    ),
    "deepseek_vl": Family(
        chat=_DEEPSEEK_CHAT,
        image="<image_placeholder>",
        named={"image_token": "<image_placeholder>"},
        config=_deepseek_config,
        images={"image_processor_type": "DeepseekVLImageProcessor", "size": SQUARE},
        processor={"processor_class": "DeepseekVLProcessor", "num_image_tokens": 16},
    ),
    "janus": Family(
        chat=replace(
            _DEEPSEEK_CHAT,
            heads={"user": "<|User|>: ", "assistant": "<|Assistant|>: "},
            prompt="<|Assistant|>:",
        ),
        image="<image_placeholder>\n",
        named={
            "image_token": "<image_placeholder>",
            "boi_token": "<begin_of_image>",
            "eoi_token": "<end_of_image>",
        },
        special=("<|User|>", "<|Assistant|>"),
        config=_janus_config,
        images={"image_processor_type": "JanusImageProcessor", "size": SQUARE},
        processor={"processor_class": "JanusProcessor", "num_image_tokens": 16},
    ),
    "gemma3": Family(
        chat=GEMMA3,
        image="<start_of_image>",
        named={
            "boi_token": "<start_of_image>",
            "eoi_token": "<end_of_image>",
            "image_token": "<image_soft_token>",
        },
        config=_gemma3_config,
        images={"image_processor_type": "Gemma3ImageProcessor", "size": SQUARE},
        processor={"processor_class": "Gemma3Processor", "image_seq_length": 4},
    ),
    "paligemma": Family(
        # There is no public template: this is the prompt that its processor makes by itself.
        chat=Chat(
            special=("<pad>", "<eos>", "<bos>"),
            begin="<bos>",
            end="<eos>",
            pad="<pad>",
            tails={"user": "\n"},
            prompt="",
            images_first=True,
        ),
        image="<image>",
        named={"image_token": "<image>"},
        config=_paligemma_config,
        images={
            "image_processor_type": "SiglipImageProcessor",
            "size": SQUARE,
            "image_seq_length": 16,
        },
        processor={"processor_class": "PaliGemmaProcessor"},
    ),
}
