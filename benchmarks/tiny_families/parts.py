"""Parts that several families share: towers for images of 56 pixels in 4 x 4 patches of 14, image
processors, and windows of attention."""

from typing import Any

from model_adapters.tiny.twin import HIDDEN, SPREAD

__all__ = [
    "GRID_TOWER",
    "PATCH",
    "PINPOINTS",
    "SIDE",
    "SLIDING",
    "SQUARE",
    "TOWER",
    "WINDOW",
    "got_images",
    "siglip",
    "tower",
    "video",
]

SIDE = 56
PATCH = 14
SQUARE = {"height": SIDE, "width": SIDE}
# Sizes of an image in tiles.
PINPOINTS = [[SIDE, 2 * SIDE], [2 * SIDE, SIDE], [2 * SIDE, 2 * SIDE]]
# Tokens; shorter than the trial's context, so that a window that is not kept shows in the replies.
WINDOW = 64
SLIDING: dict[str, Any] = {
    "layer_types": ["sliding_attention", "full_attention"],
    "sliding_window": WINDOW,
}
TOWER = {
    "hidden_size": 32,
    "intermediate_size": 64,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "image_size": SIDE,
    "patch_size": PATCH,
    "initializer_range": SPREAD,
}
# Of towers that take images of any size as a grid of patches.
GRID_TOWER = {
    "depth": 2,
    "hidden_size": 32,
    "intermediate_size": 64,
    "num_heads": 2,
    "out_hidden_size": HIDDEN,
    "initializer_range": SPREAD,
}


def tower(model_type: str | None = None, **settings: Any) -> dict[str, Any]:
    """Return the config of a tiny tower for images of one size."""
    return TOWER | ({} if model_type is None else {"model_type": model_type}) | settings


def siglip(**settings: Any) -> dict[str, Any]:
    """Return the config of a tiny SigLIP tower."""
    return tower("siglip_vision_model", vision_use_head=False, **settings)


def got_images(**settings: Any) -> dict[str, Any]:
    """Return the image processor of families that cut an image into tiles as GOT-OCR does."""
    return {"image_processor_type": "GotOcr2ImageProcessor", "size": SQUARE, **settings}


def video(name: str, **settings: Any) -> dict[str, Any]:
    """Return the video processor of this class."""
    return {"video_processor_type": name, **settings}
