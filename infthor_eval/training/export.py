"""A trained model as a checkpoint that its family's adapter loads."""

from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, naming
from model_adapters.hf.loaded import Loaded

__all__ = ["export"]


def export(loaded: Loaded, folder: Path) -> None:
    """Write weights (safetensors), configs, tokenizer with its template, and image processor.

    The template is the one that the model was trained with: what it is asked by later is what it knows.

    Args:
        loaded: the model.
        folder: made if it does not exist.

    Raises:
        DataError: it cannot be written.
    """
    model: Any = loaded.model
    with naming(f"{folder}: the checkpoint cannot be written", "make room, or choose another folder", as_a=DataError):
        folder.mkdir(parents=True, exist_ok=True)
        loaded.tokenizer.chat_template = loaded.template
        loaded.tokenizer.save_pretrained(folder)
        loaded.image_processor.save_pretrained(folder)
        model.save_pretrained(folder)
