"""The model that training starts from, with the marks of sequences as tokens."""

from collections.abc import Mapping

import torch

from infthor_eval.errors import UsageError
from infthor_eval.household.sequence_text import MARKS
from model_adapters import has_option, load
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.loading.loaded import LoadedCheckpoint


def load_starting_model(
    model: str, options: Mapping[str, str], prompt: str, seed: int, max_tokens: int | None = None
) -> LoadedCheckpoint:
    """Load a model and add the marks of sequences to its tokens.

    Args:
        model: name of the model.
        options: options of the model as typed.
        prompt: template of the sequences, "plain" or "chat".
        seed: seed of the weights of a tiny model.
        max_tokens: most tokens of a sequence of the training. Where rotary frequencies depend on
            the length, all sequences have those of this length, as in the published trainer; None
            for a model that is not trained.
    """
    loaded_model = (
        load(model, {**options, "prompt": prompt}, seed) if has_option(model, "prompt") else None
    )
    if not isinstance(loaded_model, TransformersModel):
        raise UsageError(f"{model} cannot be trained here; use a model of a transformers family")
    _add_marks(loaded_model.loaded)
    if max_tokens is not None:
        loaded_model.fix_rope(max_tokens)
    return loaded_model.loaded


def _add_marks(loaded: LoadedCheckpoint) -> None:
    """Make every mark of a sequence a single token, in a fixed order.

    The embedding of a new token is the mean of all others: the published training freezes input
    embeddings, so an arbitrary row would never be trained.
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
    layers = (model.get_input_embeddings(), model.get_output_embeddings())
    # One if the head is tied.
    tables = {id(layer.weight): layer.weight for layer in layers if layer is not None}
    with torch.no_grad():
        for weight in tables.values():
            weight[ids] = weight[: min(ids)].float().mean(dim=0).to(weight)
