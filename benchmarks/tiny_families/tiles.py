"""Families that cut an image into tiles of the size that their towers take."""

from dataclasses import replace
from typing import Any

from tiny_families.chats import CHATML, COHERE, headers
from tiny_families.checkpoint import Family, Vocabulary
from tiny_families.parts import (
    PATCH,
    PINPOINTS,
    SIDE,
    SLIDING,
    SQUARE,
    WINDOW,
    got_images,
    siglip,
    tower,
    video,
)

__all__ = ["TILES"]

_ONEVISION_CHAT = replace(
    headers(
        "<|im_start|>{} ",
        "<|im_end|>",
        special=CHATML.special,
        end=CHATML.end,
        pad=CHATML.pad,
        images_first=True,
    ),
    prompt="<|im_start|>assistant\n",
)


def _onevision_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_index": vocabulary["<image>"],
        "video_token_index": vocabulary["<video>"],
        "image_grid_pinpoints": PINPOINTS,
        "vision_config": siglip(),
        "text_config": vocabulary.text("qwen2"),
    }


def _internvl_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<IMG_CONTEXT>"],
        "image_seq_length": 4,
        "vision_config": tower(image_size=[SIDE, SIDE], patch_size=[PATCH, PATCH]),
        "text_config": vocabulary.text("qwen3"),
    }


_LLAMA4_TOKENS = (
    "<|image_start|>",
    "<|image_end|>",
    "<|tile_x_separator|>",
    "<|tile_y_separator|>",
    "<|image|>",
    "<|patch|>",
)


def _llama4_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "boi_token_index": vocabulary["<|image_start|>"],
        "eoi_token_index": vocabulary["<|image_end|>"],
        "image_token_index": vocabulary["<|patch|>"],
        "vision_config": tower(
            intermediate_size=128,  # of four patches that are merged
            vision_output_dim=32,
            projector_input_dim=32,
            projector_output_dim=32,
        ),
        "text_config": vocabulary.text(
            intermediate_size_mlp=64,
            num_local_experts=2,
            no_rope_layers=[1, 0],
            attention_chunk_size=2 * WINDOW,  # whole blocks of vLLM's cache
            floor_scale=WINDOW,  # positions at which the temperature of attention changes
        ),
    }


_LLAMA3 = headers(
    "<|start_header_id|>{}<|end_header_id|>\n\n",
    "<|eot_id|>",
    special=(
        "<|begin_of_text|>",
        "<|finetune_right_pad_id|>",
        "<|start_header_id|>",
        "<|end_header_id|>",
        "<|eot_id|>",
        "<|python_tag|>",
    ),
    begin="<|begin_of_text|>",
    end="<|eot_id|>",
    pad="<|finetune_right_pad_id|>",
    start="<|begin_of_text|>",
)


_LLAMA4 = headers(
    "<|header_start|>{}<|header_end|>\n\n",
    "<|eot|>",
    special=("<|begin_of_text|>", "<|pad|>", "<|header_start|>", "<|header_end|>", "<|eot|>"),
    begin="<|begin_of_text|>",
    end="<|eot|>",
    pad="<|pad|>",
    start="<|begin_of_text|>",
)


def _mllama_config(vocabulary: Vocabulary) -> dict[str, Any]:
    """The image token is behind the vocabulary, as in the published ones."""
    image = vocabulary["<|image|>"]
    text = vocabulary.text(vocab_size=image, cross_attention_layers=[1], num_hidden_layers=3)
    return {
        "image_token_index": image,
        "text_config": text,
        "vision_config": {
            **tower(attention_heads=2),
            "num_global_layers": 1,
            "intermediate_layers_indices": [0],
            "vision_output_dim": 64,
            "max_num_tiles": 4,
        },
    }


def _cohere_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {"vision_config": siglip(), "text_config": vocabulary.text("cohere2", **SLIDING)}


_COHERE_TOKENS = {
    "boi_token": "<|START_OF_IMG|>",
    "eoi_token": "<|END_OF_IMG|>",
    "image_token": "<|IMG_PATCH|>",
    "img_line_break_token": "<|IMG_LINE_BREAK|>",
}


TILES = {
    "llava_onevision": Family(
        chat=_ONEVISION_CHAT,
        image="<image>",
        named={"image_token": "<image>", "video_token": "<video>"},
        config=_onevision_config,
        images={
            "image_processor_type": "LlavaOnevisionImageProcessor",
            "size": SQUARE,
            "image_grid_pinpoints": PINPOINTS,
        },
        processor={
            "processor_class": "LlavaOnevisionProcessor",
            "num_image_tokens": 16,
            "vision_feature_select_strategy": "full",
            "vision_aspect_ratio": "anyres_max_9",
        },
        video=video("LlavaOnevisionVideoProcessor"),
    ),
    "internvl": Family(
        chat=CHATML,
        image="<IMG_CONTEXT>\n",
        named={
            "start_image_token": "<img>",
            "end_image_token": "</img>",
            "context_image_token": "<IMG_CONTEXT>",
            "video_token": "<video>",
        },
        config=_internvl_config,
        images=got_images(crop_to_patches=False),
        processor={"processor_class": "InternVLProcessor", "image_seq_length": 4},
        video=video("InternVLVideoProcessor"),
    ),
    "llama4": Family(
        chat=_LLAMA4,
        image="<|image|>",
        special=_LLAMA4_TOKENS,
        config=_llama4_config,
        images={
            "image_processor_type": "Llama4ImageProcessor",
            "size": SQUARE,
            "max_patches": 4,
        },
        processor={"processor_class": "Llama4Processor", "patch_size": PATCH},
    ),
    "mllama": Family(
        chat=_LLAMA3,
        image="<|image|>",
        special=("<|image|>",),
        config=_mllama_config,
        images={"image_processor_type": "MllamaImageProcessor", "size": SQUARE},
        processor={"processor_class": "MllamaProcessor"},
    ),
    "aya_vision": Family(
        chat=COHERE,
        image="<image>",
        special=("<image>", *_COHERE_TOKENS.values(), "TILE_GLOBAL", "TILE"),
        config=lambda vocabulary: {
            "image_token_index": vocabulary["<|IMG_PATCH|>"],
            "alignment_intermediate_size": 64,
            **_cohere_config(vocabulary),
        },
        images=got_images(crop_to_patches=True, max_patches=4),
        processor={
            "processor_class": "AyaVisionProcessor",
            "patch_size": PATCH,
            "img_size": SIDE,
            "downsample_factor": 2,
        },
    ),
    "cohere2_vision": Family(
        chat=COHERE,
        image="<|IMG_PATCH|>",
        named=_COHERE_TOKENS,
        config=lambda vocabulary: {
            "image_token_id": vocabulary["<|IMG_PATCH|>"],
            "alignment_intermediate_size": 64,
            **_cohere_config(vocabulary),
        },
        # A tile has the square of `patch_size` tokens, which is no size of patches.
        images={
            "image_processor_type": "Cohere2VisionImageProcessor",
            "size": SQUARE,
            "max_patches": 4,
            "patch_size": 2,
        },
        processor={"processor_class": "Cohere2VisionProcessor"},
    ),
}
