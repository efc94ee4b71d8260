"""A trained model as a checkpoint that its family's adapter loads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch.distributed.tensor import DTensor

from infthor_eval.errors import DataError, wrap_errors
from model_adapters.hf.loaded import Loaded

__all__ = ["export", "whole_weights"]


def whole_weights(model: torch.nn.Module) -> dict[str, torch.Tensor] | None:
    """Weights that lie in shards on several processes, put together; None where they are whole.

    All processes have to call it.
    """
    weights = model.state_dict()
    if not any(isinstance(tensor, DTensor) for tensor in weights.values()):
        return None
    return {
        name: tensor.full_tensor().cpu() if isinstance(tensor, DTensor) else tensor for name, tensor in weights.items()
    }


def export(loaded: Loaded, folder: Path, weights: Mapping[str, torch.Tensor] | None = None) -> None:
    """Write weights (safetensors), configs, tokenizer with its template, and image processor.

    The template is the one that the model was trained with: what it is asked by later is what it knows.

    Args:
        loaded: the model.
        folder: made if it does not exist.
        weights: of the model, where it has shards of them alone.

    Raises:
        DataError: it cannot be written.
    """
    model: Any = loaded.model
    with wrap_errors(
        f"{folder}: the checkpoint cannot be written", "make room, or choose another folder", raise_as=DataError
    ):
        folder.mkdir(parents=True, exist_ok=True)
        loaded.tokenizer.chat_template = loaded.template
        loaded.tokenizer.save_pretrained(folder)
        loaded.image_processor.save_pretrained(folder)
        model.save_pretrained(folder, state_dict=None if weights is None else dict(weights))
