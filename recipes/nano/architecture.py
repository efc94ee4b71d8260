"""The untrained small model: Qwen2.5-VL with random weights, and a tokenizer for household words.

A frame is 168 x 168 pixels: twelve by twelve patches, and three by three tokens. Words are single
tokens, and so are some texts of several words.
"""

from collections.abc import Iterable
from typing import Any

from tokenizers import AddedToken
from transformers import Qwen2_5_VLConfig
from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

from infthor_eval.household.sequence_text import MARKS
from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.hf.loading.checkpoint import assemble
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.templates import plain_template
from model_adapters.tiny.qwen2_5_vl import SPECIAL
from model_adapters.tiny.tokenizer import train_tokenizer
from model_adapters.tiny.twin import draw_model, token_ids
from recipes.nano.reading.first_weights import Part, part_width
from recipes.nano.settings import NanoRecipe

PATCHES = 12  # along each side of a frame
BLOCK = 4  # along each side of a token's part of it
GRID = PATCHES // BLOCK  # tokens along each side
PATCH_SIDE = 14  # pixels
_VISION_HEADS = 4
_THETA = 1e8  # the slowest positions turn by less than a radian in the longest trajectory
# The processor rounds frames down to fewer pixels than the one, and up to more than the other; so
# frames of any size become 168 x 168, which is between them.
_MIN_PIXELS, _MAX_PIXELS = 28_000, 28_400
_N_MERGED = 3000  # more than the number of words, so that every word is a token
_END, _PAD = "<|im_end|>", "<|endoftext|>"
# For servers, which otherwise look for Qwen2.5-VL's own marks between turns: a reply is what comes
# behind the prompt.
_RESPONSE_TEMPLATE = {
    "defaults": {"role": "assistant"},
    "start_anchor_pattern": r"\Z",
    "fields": {"content": {"close": [_END, _PAD], "content": "text"}},
}


def image_processor() -> Any:
    """Return the image processor."""
    return Qwen2VLImageProcessorPil(
        min_pixels=_MIN_PIXELS, max_pixels=_MAX_PIXELS, merge_size=BLOCK
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
        end=_END,
        pad=_PAD,
        named={"image_token": "<|image_pad|>"},
        corpus=corpus,
        n_merged=_N_MERGED,
    )
    tokenizer.response_template = _RESPONSE_TEMPLATE
    tokenizer.add_tokens([AddedToken(sentence, normalized=False) for sentence in sentences])
    ids = token_ids(SPECIAL, tokenizer)
    model = draw_model(_config(recipe, ids, len(tokenizer)), recipe.seed, ids[_END], ids[_PAD])
    processor = image_processor()
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
            "intermediate_size": width,
            "num_hidden_layers": recipe.layers,
            "num_attention_heads": len(Part),
            "num_key_value_heads": len(Part),
            "max_position_embeddings": 32_768,
            "bos_token_id": None,
            "eos_token_id": ids[_END],
            "pad_token_id": ids[_PAD],
            "tie_word_embeddings": True,
            "rope_parameters": {
                "rope_type": "default",
                "rope_theta": _THETA,
                "mrope_section": _rope_sections(part_width(width)),
            },
        },
        vision_config={
            "depth": vision.layers,
            "hidden_size": vision.hidden,
            "intermediate_size": 2 * vision.hidden,
            "num_heads": _VISION_HEADS,
            "out_hidden_size": width,
            "patch_size": PATCH_SIDE,
            "spatial_merge_size": BLOCK,
            "window_size": PATCHES * PATCH_SIDE,  # the whole frame
            "fullatt_block_indexes": list(range(vision.layers)),
        },
    )


def _rope_sections(head_width: int) -> list[int]:
    """Return a head's frequencies for time, height and width, in about the family's proportion."""
    frequencies = head_width // 2
    space = 3 * frequencies // 8
    return [frequencies - 2 * space, space, space]
