"""Families that cut an image into tiles, with a row and a column for each or a grid of them."""

from dataclasses import replace
from typing import Any

from model_adapters.tiny.twin import HIDDEN, SPREAD
from tiny_families.chats import CHATML, Chat
from tiny_families.checkpoint import Family, Vocabulary
from tiny_families.parts import PATCH, SIDE, SQUARE, tower, video

__all__ = ["CROPS"]

_TILE_TOKENS = tuple(f"<row_{row}_col_{column}>" for row in range(1, 7) for column in range(1, 7))


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
        special=_TILE_TOKENS,
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


CROPS = {
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
