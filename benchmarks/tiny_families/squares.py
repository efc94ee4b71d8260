"""Families whose towers take images of one size, a few of them as tiles of an image."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from model_adapters.tiny.twin import HEAD, HIDDEN, SPREAD
from tiny_families.chats import CHATML, COHERE, GEMMA3, GEMMA4, MISTRAL, VICUNA, Chat, headers
from tiny_families.checkpoint import Family, Vocabulary
from tiny_families.towers import PATCH, SIDE, SQUARE, got_images, siglip, tower, video

__all__ = ["SQUARES"]

# Shorter than the trial's context, so that a window that is not kept shows in the replies.
_WINDOW = 64
_SLIDING = {
    "layer_types": ["sliding_attention", "full_attention"],
    "sliding_window": _WINDOW,
}
_PINPOINTS = [[SIDE, 2 * SIDE], [2 * SIDE, SIDE], [2 * SIDE, 2 * SIDE]]


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
        "image_grid_pinpoints": _PINPOINTS,
        "vision_config": siglip(),
        "text_config": vocabulary.text("qwen2"),
    }


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
        "text_config": vocabulary.text(query_pre_attn_scalar=HEAD, **_SLIDING),
    }


_GEMMA4_TOKENS = {
    "boi_token": "<|image>",
    "eoi_token": "<image|>",
    "image_token": "<|image|>",
    "boa_token": "<|audio>",
    "eoa_token": "<audio|>",
    "audio_token": "<|audio|>",
}


def _gemma4_config(vocabulary: Vocabulary) -> dict[str, Any]:
    """As in the smaller published ones: inputs of each layer, the last layers' keys shared."""
    return {
        **{f"{name}_id": vocabulary[token] for name, token in _GEMMA4_TOKENS.items()},
        "video_token_id": vocabulary["<|video|>"],
        "audio_config": None,
        "text_config": vocabulary.text(
            **_SLIDING | {"layer_types": 2 * _SLIDING["layer_types"]},
            num_hidden_layers=4,
            num_kv_shared_layers=2,
            global_head_dim=2 * HEAD,
            hidden_size_per_layer_input=8,
            vocab_size_per_layer_input=vocabulary.size,
        ),
        "vision_config": {
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "num_key_value_heads": 2,
            "head_dim": 16,
            "position_embedding_size": 64,
            "initializer_range": SPREAD,
        },
    }


def _paligemma_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_index": vocabulary["<image>"],
        "projection_dim": HIDDEN,
        "hidden_size": HIDDEN,
        "vision_config": siglip(projection_dim=HIDDEN),
        "text_config": vocabulary.text("gemma"),
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
            attention_chunk_size=_WINDOW,
        ),
    }


def _cohere_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {"vision_config": siglip(), "text_config": vocabulary.text("cohere2", **_SLIDING)}


_COHERE_TOKENS = {
    "boi_token": "<|START_OF_IMG|>",
    "eoi_token": "<|END_OF_IMG|>",
    "image_token": "<|IMG_PATCH|>",
    "img_line_break_token": "<|IMG_LINE_BREAK|>",
}

_TILES = tuple(f"<row_{row}_col_{column}>" for row in range(1, 7) for column in range(1, 7))
_IDEFICS = Chat(
    special=("<|endoftext|>", "<|im_start|>", "<end_of_utterance>"),
    begin="<|im_start|>",
    end="<end_of_utterance>",
    pad="<|endoftext|>",
    start="<|im_start|>",
    heads={"system": "System: ", "user": "User:", "assistant": "Assistant:"},
    tails=dict.fromkeys(("system", "user", "assistant"), "<end_of_utterance>\n"),
)


def _idefics3(name: str, side: int, patch: int, scale: int, **settings: Any) -> Family:
    """Idefics3 and SmolVLM; each tile takes four tokens."""

    def config(vocabulary: Vocabulary) -> dict[str, Any]:
        return {
            "image_token_id": vocabulary["<image>"],
            "scale_factor": scale,
            "pad_token_id": vocabulary["<|endoftext|>"],
            "vision_config": tower(image_size=side, patch_size=patch),
            "text_config": vocabulary.text("llama"),
        }

    return Family(
        chat=_IDEFICS,
        image="<image>",
        named={
            "image_token": "<image>",
            "fake_image_token": "<fake_token_around_image>",
            "end_of_utterance_token": "<end_of_utterance>",
            "global_image_token": "<global-img>",
        },
        special=_TILES,
        config=config,
        images={
            "image_processor_type": f"{name}ImageProcessor",
            "size": {"longest_edge": 2 * side},
            "max_image_size": {"longest_edge": side},
        },
        processor={"processor_class": f"{name}Processor", "image_seq_len": 4},
        **settings,
    )


def _idefics2_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<image>"],
        "vision_config": tower(image_size=2 * SIDE),
        "perceiver_config": {
            "hidden_size": HIDDEN,
            "resampler_n_latents": 4,
            "resampler_depth": 1,
            "resampler_n_heads": 2,
            "resampler_head_dim": 16,
            "num_key_value_heads": 1,
            "initializer_range": SPREAD,
        },
        "text_config": vocabulary.text("mistral"),
    }


_OVIS_INDICATORS = ("<IMG_START>", "<IMG_GRID>", "<IMG_COL>", "<IMG_ROW>", "<IMG_END>")


def _ovis2_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<IMG_ATOM>"],
        "visual_indicator_token_ids": [vocabulary[token] for token in _OVIS_INDICATORS],
        "vocab_size": vocabulary.size,
        "hidden_size": HIDDEN,
        "vision_config": tower(vocab_size=64, hidden_stride=2),
        "text_config": vocabulary.text("qwen2"),
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
            "supported_aspect_ratios": [
                [1, 1],
                [1, 2],
                [1, 3],
                [1, 4],
                [2, 1],
                [2, 2],
                [3, 1],
                [4, 1],
            ],
        },
    }


_MOLMO_TOKENS = (
    "<im_start>",
    "<im_end>",
    "<im_patch>",
    "<im_col>",
    "<low_res_im_start>",
    "<frame_start>",
    "<frame_end>",
)


def _molmo2_config(vocabulary: Vocabulary) -> dict[str, Any]:
    """Tokens of images are behind the vocabulary, as in the published ones."""
    n_words = vocabulary["<im_start>"]
    return {
        "image_start_token_id": n_words,
        "image_end_token_id": vocabulary["<im_end>"],
        "image_patch_id": vocabulary["<im_patch>"],
        "low_res_image_start_token_id": vocabulary["<low_res_im_start>"],
        "frame_start_token_id": vocabulary["<frame_start>"],
        "frame_end_token_id": vocabulary["<frame_end>"],
        "vision_config": tower(image_size=[SIDE, SIDE], num_key_value_heads=2, head_dim=16),
        "adapter_config": {
            "vision_feature_layer": [1, 0],
            "hidden_size": 32,
            "num_attention_heads": 2,
            "num_key_value_heads": 2,
            "head_dim": 16,
            "intermediate_size": 64,
            "text_hidden_size": HIDDEN,
            "initializer_range": SPREAD,
        },
        "text_config": vocabulary.text(
            vocab_size=n_words, additional_vocab_size=vocabulary.size - n_words
        ),
    }


SQUARES = {
    "llava": _llava("Llava", _clip_images("CLIP")),
    "llava_next": _llava(
        "LlavaNext",
        _clip_images("LlavaNext", image_grid_pinpoints=_PINPOINTS),
        replace(MISTRAL, images_first=True),
        "mistral",
        image_grid_pinpoints=_PINPOINTS,
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
    "llava_onevision": Family(
        chat=_ONEVISION_CHAT,
        image="<image>",
        named={"image_token": "<image>", "video_token": "<video>"},
        config=_onevision_config,
        images={
            "image_processor_type": "LlavaOnevisionImageProcessor",
            "size": SQUARE,
            "image_grid_pinpoints": _PINPOINTS,
        },
        processor={
            "processor_class": "LlavaOnevisionProcessor",
            "num_image_tokens": 16,
            "vision_feature_select_strategy": "full",
            "vision_aspect_ratio": "anyres_max_9",
        },
        video=video("LlavaOnevisionVideoProcessor"),
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
    "gemma4": Family(
        chat=GEMMA4,
        image="\n\n<|image|>\n\n",
        named=_GEMMA4_TOKENS,
        special=("<|video|>",),
        config=_gemma4_config,
        images={"image_processor_type": "Gemma4ImageProcessor", "max_soft_tokens": 70},
        processor={
            "processor_class": "Gemma4Processor",
            "feature_extractor": {"feature_extractor_type": "Gemma4AudioFeatureExtractor"},
        },
        video=video("Gemma4VideoProcessor"),
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
    "idefics3": _idefics3("Idefics3", SIDE, PATCH, 2),
    # Its model takes a size of patches that divides the tokens of a tile.
    "smolvlm": _idefics3("SmolVLM", 32, 4, 4, video=video("SmolVLMVideoProcessor")),
    "idefics2": Family(
        chat=replace(
            _IDEFICS,
            special=("<unk>", "<s>", "</s>", "<end_of_utterance>"),
            begin="<s>",
            pad="<unk>",
            start="",
        ),
        image="<image>",
        special=("<fake_token_around_image>", "<image>"),
        config=_idefics2_config,
        images={
            "image_processor_type": "Idefics2ImageProcessor",
            "size": {"shortest_edge": SIDE, "longest_edge": 2 * SIDE},
        },
        processor={"processor_class": "Idefics2Processor", "image_seq_len": 4},
    ),
    "ovis2": Family(
        chat=CHATML,
        image="<image>\n",
        special=("<image>", "<IMG_ATOM>", *_OVIS_INDICATORS),
        config=_ovis2_config,
        images={"image_processor_type": "Ovis2ImageProcessor", "size": SQUARE},
        processor={"processor_class": "Ovis2Processor", "image_seq_length": 4},
    ),
    "molmo2": Family(
        chat=CHATML,
        image="<|image|>",
        named={"image_token": "<|image|>", "video_token": "<|video|>"},
        special=_MOLMO_TOKENS,
        config=_molmo2_config,
        images={
            "image_processor_type": "Molmo2ImageProcessor",
            "size": SQUARE,
            "max_crops": 4,
            "overlap_margins": [1, 1],
        },
        processor={"processor_class": "Molmo2Processor"},
        video=video("Molmo2VideoProcessor"),
    ),
}
