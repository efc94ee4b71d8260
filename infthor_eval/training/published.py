"""Checkpoints of the published trainer: folders of torch's distributed checkpoints, on top of a checkpoint of the hub.

Nothing exports them; this puts their weights into the model that they began with, which is then written as every
other checkpoint is.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.distributed.checkpoint as dcp
from torch.distributed.checkpoint.metadata import TensorStorageMetadata

from infthor_eval.errors import DataError, wrap_errors
from model_adapters.hf.loaded import Loaded

__all__ = ["ImportedWeights", "import_weights"]

_MEND = "give a folder with .metadata and *.distcp files of the model that --model names"


@dataclass(frozen=True)
class ImportedWeights:
    """What was taken over.

    Attributes:
        n_taken: weights that the folder has.
        n_kept: weights of the model that it has not; they stay those of the checkpoint that it began with.
        n_ignored: tensors of the folder that are no weights (an optimizer's).
    """

    n_taken: int
    n_kept: int
    n_ignored: int


def import_weights(loaded: Loaded, folder: Path) -> ImportedWeights:
    """Put the weights of a distributed checkpoint into a model.

    Weights may stand under any prefix ("model.", "app.model."), one for all of them.

    Args:
        loaded: the model that the training began with, the marks of sequences among its tokens.
        folder: of the checkpoint.

    Raises:
        DataError: it is none, or holds another model's weights.
    """
    with wrap_errors(f"{folder}: not a distributed checkpoint", _MEND, catch=Exception):
        reader = dcp.FileSystemReader(folder)
        stored: Mapping[str, Any] = reader.read_metadata().state_dict_metadata
        sizes = {name: item.size for name, item in stored.items() if isinstance(item, TensorStorageMetadata)}
    weights = loaded.model.state_dict()
    prefix = _prefix(sizes, weights, folder)
    taken = {name.removeprefix(prefix): size for name, size in sizes.items() if name.startswith(prefix)}
    taken = {name: size for name, size in taken.items() if name in weights}
    for name, size in taken.items():
        if size != weights[name].shape:
            raise DataError(
                f"{folder}: {name} is {tuple(size)}, the model's {tuple(weights[name].shape)}; it began with another "
                "checkpoint, or other tokens"
            )
    read = {f"{prefix}{name}": torch.empty_like(weights[name]) for name in taken}
    with wrap_errors(f"{folder}: cannot be read", "restore its files", catch=Exception):
        dcp.load(read, storage_reader=reader, no_dist=True)
    loaded.model.load_state_dict({name.removeprefix(prefix): tensor for name, tensor in read.items()}, strict=False)
    return ImportedWeights(len(taken), len(weights) - len(taken), len(sizes) - len(taken))


def _prefix(sizes: Mapping[str, Any], weights: Mapping[str, Any], folder: Path) -> str:
    """What stands before the names of weights in the folder: the one that explains most of them."""
    found: dict[str, int] = {}
    for name in sizes:
        parts = name.split(".")
        for at in range(len(parts)):
            if ".".join(parts[at:]) in weights:
                prefix = "".join(f"{part}." for part in parts[:at])
                found[prefix] = found.get(prefix, 0) + 1
                break
    # An optimizer's moments bear the weights' names too, under a prefix of their own.
    found = {prefix: n for prefix, n in found.items() if not prefix.startswith(("optim", "state"))}
    if not found:
        raise DataError(f"{folder}: no weight of this model is in it; {_MEND}")
    return max(found, key=lambda prefix: (found[prefix], -len(prefix)))
