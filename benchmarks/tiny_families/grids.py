"""Families whose towers take an image of any size as a grid of patches."""

from collections.abc import Mapping
from typing import Any

from model_adapters.tiny.twin import HEAD, HIDDEN, SPREAD
from tiny_families.chats import CHATML, GEMMA4, GLM, MISTRAL, Chat, headers
from tiny_families.checkpoint import Family, Vocabulary
from tiny_families.parts import GRID_TOWER, PATCH, SLIDING, TOWER, video

__all__ = ["GRIDS"]

_QWEN_TOKENS = {
    "image_token": "<|image_pad|>",
    "video_token": "<|video_pad|>",
    "vision_start_token": "<|vision_start|>",
    "vision_end_token": "<|vision_end|>",
}
_QWEN_IMAGE = "<|vision_start|><|image_pad|><|vision_end|>"
_SMALL = {"shortest_edge": 1024, "longest_edge": 160 * 160}  # areas in pixels
_EXPERTS = {"num_experts": 4, "num_experts_per_tok": 2, "moe_intermediate_size": 32}


def _three_axes(*sections: int, **settings: Any) -> dict[str, Any]:
    """Return rotary positions of three axes: time, height, width."""
    rope = {"rope_type": "default", "rope_theta": 1e6, "mrope_section": list(sections)}
    return {"rope_parameters": rope | settings}


def _qwen(
    text: Mapping[str, Any], vision: Mapping[str, Any], processor: str, videos: str, patch: int = 16
) -> Family:
    def config(vocabulary: Vocabulary) -> dict[str, Any]:
        return {
            **{f"{name}_id": vocabulary[token] for name, token in _QWEN_TOKENS.items()},
            "text_config": vocabulary.text(**text),
            "vision_config": {**GRID_TOWER, **vision},
        }

    return Family(
        chat=CHATML,
        image=_QWEN_IMAGE,
        named=_QWEN_TOKENS,
        config=config,
        images={
            "image_processor_type": "Qwen2VLImageProcessor",
            "patch_size": patch,
            "size": _SMALL,
        },
        processor={"processor_class": processor},
        video=video(videos),
    )


def _qwen3(text: Mapping[str, Any], **vision: Any) -> Family:
    """Qwen3-VL's tower, whose positions are interpolated from a square grid of them."""
    return _qwen(
        text, {"num_position_embeddings": 64} | vision, "Qwen3VLProcessor", "Qwen3VLVideoProcessor"
    )


_INTERLEAVED = _three_axes(6, 5, 5, mrope_interleaved=True)
_DEEPSTACK = {"deepstack_visual_indexes": [0, 1]}
# As many linear layers to a layer of attention as in the published ones would make it slow.
_LINEAR = {
    "layer_types": ["linear_attention", "full_attention"],
    "linear_key_head_dim": 16,
    "linear_value_head_dim": 16,
    "linear_num_key_heads": 2,
    "linear_num_value_heads": 4,
    "head_dim": 64,
    "partial_rotary_factor": 0.5,
}

_GLM_TOKENS = {"image_token": "<|image|>", "video_token": "<|video|>"}
_GLM_MARKERS = {
    f"{kind}_{place}_token_id": f"<|{word}_of_{kind}|>"
    for kind in ("image", "video")
    for place, word in (("start", "begin"), ("end", "end"))
}


def _glm(name: str, **text: Any) -> Family:
    """GLM-4.1V and its successors; half of a head is rotated."""

    def config(vocabulary: Vocabulary) -> dict[str, Any]:
        named = {f"{name}_id": token for name, token in _GLM_TOKENS.items()} | _GLM_MARKERS
        return {
            **{name: vocabulary[token] for name, token in named.items()},
            "text_config": vocabulary.text(
                # transformers has biases whatever this says, vLLM has them if it says so.
                **{
                    "attention_bias": True,
                    **_three_axes(2, 3, 3, partial_rotary_factor=0.5),
                    **text,
                }
            ),
            "vision_config": {**GRID_TOWER, "image_size": 56, "patch_size": PATCH},
        }

    return Family(
        chat=GLM,
        image="<|begin_of_image|><|image|><|end_of_image|>",
        named=_GLM_TOKENS,
        special=tuple(_GLM_MARKERS.values()),
        config=config,
        images={"image_processor_type": f"{name}ImageProcessor", "size": _SMALL},
        processor={"processor_class": f"{name}Processor"},
        video=video(f"{name}VideoProcessor", size=_SMALL),
    )


_GLM_EXPERTS = {
    "n_routed_experts": 4,
    "num_experts_per_tok": 2,
    "moe_intermediate_size": 32,
    "n_shared_experts": 1,
    "first_k_dense_replace": 1,
    "use_qk_norm": False,  # of the published config; vLLM reads it
}

_ERNIE_TOKENS = {
    "image_token": "<|IMAGE_PLACEHOLDER|>",
    "image_start_token": "<|IMAGE_START|>",
    "image_end_token": "<|IMAGE_END|>",
    "video_token": "<|VIDEO_PLACEHOLDER|>",
    "video_start_token": "<|VIDEO_START|>",
    "video_end_token": "<|VIDEO_END|>",
}
_ERNIE = Chat(
    special=("<unk>", "<|begin_of_sentence|>", "</s>"),
    begin="<|begin_of_sentence|>",
    end="</s>",
    pad="<unk>",
    start="<|begin_of_sentence|>",
    heads={"user": "User: ", "assistant": "Assistant: "},
    tails={"system": "\n", "user": "\n", "assistant": "<|end_of_sentence|>"},
)


def _ernie_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        **{f"{name}_id": vocabulary[token] for name, token in _ERNIE_TOKENS.items()},
        "text_config": vocabulary.text(
            **_three_axes(6, 6, 4),
            num_hidden_layers=3,  # what frames become in the second reaches words in the third
            moe_num_experts=4,
            moe_k=2,
            moe_num_shared_experts=1,
            moe_intermediate_size=[32, 16],  # of words, of frames
        ),
        "vision_config": {**GRID_TOWER, "patch_size": PATCH},
    }


_MISTRAL_TOKENS = ("[IMG]", "[IMG_BREAK]", "[IMG_END]")


def _mistral3_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_index": vocabulary["[IMG]"],
        "text_config": vocabulary.text("mistral", sliding_window=None),
        "vision_config": {
            **TOWER,
            "model_type": "pixtral",
            "head_dim": 16,
            "image_size": 1540,
        },
        "vision_feature_layer": -1,
        "spatial_merge_size": 2,
    }


def _video_llama_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<|image_pad|>"],
        "video_token_id": vocabulary["<|video_pad|>"],
        "text_config": vocabulary.text("qwen2"),
        "vision_config": TOWER,
    }


def _lfm2_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<image>"],
        "text_config": vocabulary.text(
            "lfm2",
            layer_types=["conv", "full_attention"],
            block_multiple_of=32,
            conv_dim=HIDDEN,  # these two are of the published config, and vLLM reads them
            block_dim=HIDDEN,
        ),
        "vision_config": {
            **TOWER,
            "model_type": "siglip2_vision_model",
            "patch_size": 16,
            "num_patches": 64,
            "vision_use_head": False,
        },
        "projector_hidden_size": 64,
    }


_LFM2 = headers(
    "<|im_start|>{}\n",
    "<|im_end|>\n",
    special=("<|pad|>", "<|startoftext|>", "<|im_start|>", "<|im_end|>"),
    begin="<|startoftext|>",
    end="<|im_end|>",
    pad="<|pad|>",
    start="<|startoftext|>",
)


def _nemotron_config(vocabulary: Vocabulary) -> dict[str, Any]:
    kinds = ["linear_attention", "full_attention", "linear_attention", "mlp"]
    return {
        "image_token_id": vocabulary["<image>"],
        "text_config": vocabulary.text(
            "nemotron_h",
            layers_block_type=kinds,
            num_hidden_layers=len(kinds),
            ssm_state_size=8,
            mamba_num_heads=8,
            mamba_head_dim=32,
            n_groups=2,
            chunk_size=8,
        ),
        "vision_config": {
            "hidden_size": 32,
            "num_hidden_layers": 1,
            "num_attention_heads": 2,
            "patch_size": PATCH,
            "image_size": 4 * PATCH,
            "max_img_size": 16 * PATCH,
            "num_cls_tokens": 1,
            "num_registers": 1,
            "summary_idxs": [0],
            "video_temporal_patch_size": 2,
        },
        "projector_hidden_size": 64,
        "vision_hidden_size": 32,
    }


_MINICPM_TOKENS = {
    "image_token": "<|image_pad|>",
    "video_token": "<|video_pad|>",
    "image_start_token": "<image>",
    "image_end_token": "</image>",
    "slice_start_token": "<slice>",
    "slice_end_token": "</slice>",
    "image_id_start_token": "<image_id>",
    "image_id_end_token": "</image_id>",
}


def _minicpm_config(vocabulary: Vocabulary) -> dict[str, Any]:
    return {
        "image_token_id": vocabulary["<|image_pad|>"],
        "video_token_id": vocabulary["<|video_pad|>"],
        "text_config": vocabulary.text("qwen3_5_text", **_LINEAR),
        "vision_config": {**TOWER, "image_size": 112, "insert_layer_id": 0},
        "insert_layer_id": 0,
    }


_GEMMA4_TOKENS = {
    "boi_token": "<|image>",
    "eoi_token": "<image|>",
    "image_token": "<|image|>",
    "boa_token": "<|audio>",
    "eoa_token": "<audio|>",
    "audio_token": "<|audio|>",
}


_GEMMA4_IMAGE = 70  # tokens, at most


def _gemma4_config(vocabulary: Vocabulary) -> dict[str, Any]:
    """As in the smaller published ones: inputs of each layer, the last layers' keys shared."""
    return {
        **{f"{name}_id": vocabulary[token] for name, token in _GEMMA4_TOKENS.items()},
        "video_token_id": vocabulary["<|video|>"],
        "audio_config": None,
        "text_config": vocabulary.text(
            **SLIDING | {"layer_types": 2 * SLIDING["layer_types"]},
            num_hidden_layers=4,
            num_kv_shared_layers=2,
            global_head_dim=2 * HEAD,
            hidden_size_per_layer_input=8,
            vocab_size_per_layer_input=vocabulary.size,
        )
        # As published; vLLM takes token 0 for an image in the inputs of layers.
        | {"pad_token_id": 0},
        "vision_config": {
            "hidden_size": 32,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "num_key_value_heads": 2,
            "head_dim": 16,
            "position_embedding_size": 64,
            "initializer_range": SPREAD,
            "default_output_length": _GEMMA4_IMAGE,  # of the published configs, for vLLM
        },
    }


GRIDS = {
    "qwen2_vl": _qwen(
        _three_axes(4, 6, 6),
        {"embed_dim": 32, "hidden_size": HIDDEN},
        "Qwen2VLProcessor",
        "Qwen2VLVideoProcessor",
        patch=PATCH,
    ),
    "qwen2_5_vl": _qwen(
        _three_axes(4, 6, 6),
        {"fullatt_block_indexes": [1]},
        "Qwen2_5_VLProcessor",
        "Qwen2VLVideoProcessor",
        patch=PATCH,
    ),
    "qwen3_vl": _qwen3(_INTERLEAVED, **_DEEPSTACK),
    # vLLM reads from the published config what transformers does in any case.
    "qwen3_vl_moe": _qwen3({**_INTERLEAVED, **_EXPERTS, "norm_topk_prob": True}, **_DEEPSTACK),
    "qwen3_5": _qwen3({**_INTERLEAVED, **_LINEAR}),
    "glm4v": _glm("Glm4v"),
    "glm46v": _glm("Glm46V", model_type="glm4v_text"),
    "glm4v_moe": _glm("Glm4v", **_GLM_EXPERTS),
    "ernie4_5_vl_moe": Family(
        chat=_ERNIE,
        image="Picture {n}:<|IMAGE_START|><|IMAGE_PLACEHOLDER|><|IMAGE_END|>",
        named=_ERNIE_TOKENS,
        special=("<|end_of_sentence|>",),
        config=_ernie_config,
        images={"image_processor_type": "Ernie4_5_VLMoeImageProcessor", "size": _SMALL},
        processor={"processor_class": "Ernie4_5_VLMoeProcessor"},
        video=video("Ernie4_5_VLMoeVideoProcessor", draw_on_frames=False),
    ),
    "mistral3": Family(
        chat=MISTRAL,
        image="[IMG]",
        special=_MISTRAL_TOKENS,
        config=_mistral3_config,
        images={
            "image_processor_type": "PixtralImageProcessor",
            "patch_size": PATCH,
            "size": {"longest_edge": 1540},
        },
        processor={
            "processor_class": "PixtralProcessor",
            "patch_size": PATCH,
            "spatial_merge_size": 2,
        },
    ),
    "minicpmv4_6": Family(
        chat=CHATML,
        image="<|image_pad|>",
        named=_MINICPM_TOKENS,
        config=_minicpm_config,
        images={
            "image_processor_type": "MiniCPMV4_6ImageProcessor",
            "scale_resolution": 112,
            "max_slice_nums": 4,
        },
        processor={"processor_class": "MiniCPMV4_6Processor"},
        video=video("MiniCPMV4_6VideoProcessor"),
    ),
    "lfm2_vl": Family(
        chat=_LFM2,
        image="<image>",
        named={
            "image_token": "<image>",
            "image_start_token": "<|image_start|>",
            "image_end_token": "<|image_end|>",
            "image_thumbnail_token": "<|img_thumbnail|>",
        },
        config=_lfm2_config,
        images={
            "image_processor_type": "Lfm2VlImageProcessor",
            "min_image_tokens": 4,
            "max_image_tokens": 16,
            "tile_size": 128,
        },
        processor={"processor_class": "Lfm2VlProcessor"},
    ),
    "nemotron_h_omni": Family(
        chat=CHATML,
        image="<image>\n",
        named={"image_token": "<image>"},
        special=("<video>", "<so_embedding>", "<img>", "</img>"),
        config=_nemotron_config,
        images={
            "image_processor_type": "NemotronH_Omni_Reasoning_V3ImageProcessor",
            "patch_size": PATCH,
            "do_resize": False,  # it is scaled with the patches
            "min_num_patches": 4,
            "max_num_patches": 36,
        },
        processor={
            "processor_class": "NemotronH_Omni_Reasoning_V3Processor",
            "feature_extractor": {"feature_extractor_type": "ParakeetFeatureExtractor"},
        },
        video=video("NemotronH_Omni_Reasoning_V3VideoProcessor"),
    ),
    "video_llama_3": Family(
        chat=CHATML,
        image="<|image_pad|>\n",
        named={"image_token": "<|image_pad|>", "video_token": "<|video_pad|>"},
        config=_video_llama_config,
        images={
            "image_processor_type": "VideoLlama3ImageProcessor",
            "size": {"shortest_edge": 784, "longest_edge": 84 * 84},
        },
        processor={"processor_class": "VideoLlama3Processor"},
        video=video("VideoLlama3VideoProcessor"),
    ),
    "gemma4": Family(
        chat=GEMMA4,
        image="\n\n<|image|>\n\n",
        named=_GEMMA4_TOKENS,
        special=("<|video|>",),
        config=_gemma4_config,
        images={"image_processor_type": "Gemma4ImageProcessor", "max_soft_tokens": _GEMMA4_IMAGE},
        processor={
            "processor_class": "Gemma4Processor",
            "feature_extractor": {"feature_extractor_type": "Gemma4AudioFeatureExtractor"},
        },
        video=video("Gemma4VideoProcessor"),
    ),
}
