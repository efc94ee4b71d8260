"""The checkpoint that training begins with, made ready for sequences."""

from collections.abc import Mapping
from typing import Any

import torch

from infthor_eval.errors import UsageError
from infthor_eval.household.sequence_text import MARKS
from model_adapters import has_option, load
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.model import TransformersModel

__all__ = ["add_marks", "load_starting_model"]


def load_starting_model(model: str, options: Mapping[str, str], prompt: str, seed: int) -> Loaded:
    """Load a checkpoint and give it the marks of sequences as tokens.

    Args:
        model: name of its adapter.
        options: the adapter's, as typed.
        prompt: what its sequences are written by, "plain" or "chat".
        seed: of weights that no checkpoint has.

    Raises:
        UsageError: an unknown name or option, or a model that cannot be trained here.
        ModelError: it cannot be loaded.
    """
    found = load(model, {**options, "prompt": prompt}, seed) if has_option(model, "prompt") else None
    if not isinstance(found, TransformersModel):
        raise UsageError(f"{model} is nothing that can be trained here; take a model of a transformers family")
    add_marks(found.loaded)
    return found.loaded


def add_marks(loaded: Loaded) -> None:
    """Make every mark of a sequence a token of its own, in a fixed order.

    New tokens begin as the mean of all others: published training leaves input embeddings as they are, and rows that
    nobody ever trained may hold anything.
    """
    known = set(loaded.tokenizer.get_vocab())
    new = [mark for mark in MARKS if mark not in known]
    loaded.tokenizer.add_tokens(new, special_tokens=True)
    if not new:
        return
    model = loaded.model
    n_rows = model.get_input_embeddings().weight.shape[0]
    if len(loaded.tokenizer) > n_rows:
        model.resize_token_embeddings(len(loaded.tokenizer), mean_resizing=False)
    ids = loaded.tokenizer.convert_tokens_to_ids(new)
    tables = {id(layer.weight): layer.weight for layer in _tables(model)}  # one, where the head is tied
    with torch.no_grad():
        for weight in tables.values():
            weight[ids] = weight[: min(ids)].float().mean(dim=0).to(weight)


def _tables(model: Any) -> list[Any]:
    return [layer for layer in (model.get_input_embeddings(), model.get_output_embeddings()) if layer is not None]
