"""The untrained small model: Qwen2.5-VL with random weights, and a tokenizer for household words.

A frame is 112 x 112 pixels, which are eight by eight patches. Words are single tokens. So is the
introduction of every question of the published evaluation, which would otherwise be three quarters
of a question's tokens.
"""

from collections.abc import Iterable
from typing import Any

from tokenizers import AddedToken
from transformers import Qwen2_5_VLConfig
from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

from infthor_eval.household.sequence_text import MARKS
from infthor_eval.training.nano.settings import NanoRecipe
from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.hf.loading.checkpoint import assemble
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.templates import plain_template
from model_adapters.tiny.qwen2_5_vl import SPECIAL
from model_adapters.tiny.tokenizer import train_tokenizer
from model_adapters.tiny.twin import draw_model, token_ids

__all__ = ["PATCHES", "build_untrained", "image_processor"]

_PATCH_GRID = 8  # patches along each side of a frame
PATCHES = _PATCH_GRID**2
_SIDE = 14  # pixels of a patch
_HEADS = 4
# The processor rounds this to 112 x 112 pixels; with a limit of exactly 112 * 112 it would round
# down to 84 x 84.
_PIXELS = 12_600
_N_MERGED = 3000  # more than the number of words, so that every word is a token


def image_processor(grid: int) -> Any:
    """Return the image processor, for frames of as many tokens along each side."""
    return Qwen2VLImageProcessorPil(
        min_pixels=_PIXELS, max_pixels=_PIXELS, merge_size=_PATCH_GRID // grid
    )


def build_untrained(
    recipe: NanoRecipe, corpus: Iterable[str], sentences: Iterable[str]
) -> LoadedCheckpoint:
    """Return the model with random weights of the recipe's seed, on the CPU in float32.

    Args:
        recipe: recipe with the size of the model.
        corpus: texts with all words that become tokens.
        sentences: texts that become a single token each.
    """
    tokenizer = train_tokenizer(
        (*SPECIAL, *MARKS),
        end="<|im_end|>",
        pad="<|endoftext|>",
        named={"image_token": "<|image_pad|>"},
        corpus=corpus,
        n_merged=_N_MERGED,
    )
    tokenizer.add_tokens([AddedToken(sentence, normalized=False) for sentence in sentences])
    ids = token_ids(SPECIAL, tokenizer)
    model = draw_model(
        _config(recipe, ids, len(tokenizer)), recipe.seed, ids["<|im_end|>"], ids["<|endoftext|>"]
    )
    processor = image_processor(recipe.vision.grid)
    family = Qwen25VLFamily(model, processor, tokenizer)
    family.video = None  # it is trained on no film
    return assemble(
        model,
        tokenizer,
        processor,
        template=plain_template(tokenizer, family),
        family=family,
        max_tokens=model.config.text_config.max_position_embeddings,
        origin={"checkpoint": "nano", "seed": recipe.seed},
    )


def _config(recipe: NanoRecipe, ids: dict[str, int], vocab_size: int) -> Any:
    width, vision = recipe.hidden, recipe.vision
    return Qwen2_5_VLConfig(
        image_token_id=ids["<|image_pad|>"],
        video_token_id=ids["<|video_pad|>"],
        vision_start_token_id=ids["<|vision_start|>"],
        vision_end_token_id=ids["<|vision_end|>"],
        tie_word_embeddings=True,
        text_config={
            "vocab_size": vocab_size,
            "hidden_size": width,
            "intermediate_size": 3 * width,
            "num_hidden_layers": recipe.layers,
            "num_attention_heads": _HEADS,
            "num_key_value_heads": _HEADS,
            "max_position_embeddings": 32_768,
            "bos_token_id": None,
            "eos_token_id": ids["<|im_end|>"],
            "pad_token_id": ids["<|endoftext|>"],
            "tie_word_embeddings": True,
            "rope_parameters": {
                "rope_type": "default",
                "rope_theta": 1e4,
                "mrope_section": _rope_sections(width // _HEADS),
            },
        },
        vision_config={
            "depth": vision.layers,
            "hidden_size": vision.hidden,
            "intermediate_size": 2 * vision.hidden,
            "num_heads": _HEADS,
            "out_hidden_size": width,
            "patch_size": _SIDE,
            "spatial_merge_size": _PATCH_GRID // vision.grid,
            "window_size": _PATCH_GRID * _SIDE,  # the whole frame
            "fullatt_block_indexes": list(range(vision.layers)),
        },
    )


def _rope_sections(head_width: int) -> list[int]:
    """Return a head's frequencies for time, height and width, in about the family's proportion."""
    frequencies = head_width // 2
    space = 3 * frequencies // 8
    return [frequencies - 2 * space, space, space]
