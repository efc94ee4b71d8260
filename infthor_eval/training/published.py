"""Import of the published trainer's checkpoints: torch's distributed checkpoints of a model from the hub.

Of the published code, branch `dev` alone exports them, and Qwen2.5-VL alone. Here their weights are put into the model
that training started from, which is then written like any other checkpoint.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.distributed.checkpoint as dcp
from torch.distributed.checkpoint.metadata import TensorStorageMetadata

from infthor_eval.errors import DataError, wrap_errors
from model_adapters.hf.loaded import LoadedCheckpoint

__all__ = ["ImportedWeights", "import_weights"]

_HINT = "give a folder with .metadata and *.distcp files of the model that --model names"


@dataclass(frozen=True)
class ImportedWeights:
    """Numbers of imported tensors.

    Attributes:
        n_imported: weights that the folder has.
        n_kept: weights of the model that the folder does not have; they stay those of the initial checkpoint.
        n_ignored: tensors of the folder that are not weights (an optimizer's).
    """

    n_imported: int
    n_kept: int
    n_ignored: int


def import_weights(loaded: LoadedCheckpoint, folder: Path) -> ImportedWeights:
    """Load the weights of a distributed checkpoint into a model.

    The keys of all weights may have one common prefix ("model.", "app.model.").

    Args:
        loaded: the model that training started from, with the marks of sequences as tokens.
        folder: folder of the checkpoint.

    Raises:
        DataError: the folder is not such a checkpoint, or has another model's weights.
    """
    with wrap_errors(f"{folder}: not a distributed checkpoint", _HINT, catch=Exception):
        reader = dcp.FileSystemReader(folder)
        stored: Mapping[str, Any] = reader.read_metadata().state_dict_metadata
        sizes = {name: item.size for name, item in stored.items() if isinstance(item, TensorStorageMetadata)}
    weights = loaded.model.state_dict()
    prefix = _key_prefix(sizes, weights, folder)
    imported = {name.removeprefix(prefix): size for name, size in sizes.items() if name.startswith(prefix)}
    imported = {name: size for name, size in imported.items() if name in weights}
    for name, size in imported.items():
        if size != weights[name].shape:
            raise DataError(
                f"{folder}: {name} is {tuple(size)}, the model's {tuple(weights[name].shape)}; training started from "
                "another checkpoint, or with other tokens"
            )
    tensors = {f"{prefix}{name}": torch.empty_like(weights[name]) for name in imported}
    with wrap_errors(f"{folder}: cannot be read", "restore its files", catch=Exception):
        dcp.load(tensors, storage_reader=reader, no_dist=True)
    loaded.model.load_state_dict({name.removeprefix(prefix): tensor for name, tensor in tensors.items()}, strict=False)
    return ImportedWeights(len(imported), len(weights) - len(imported), len(sizes) - len(imported))


def _key_prefix(sizes: Mapping[str, Any], weights: Mapping[str, Any], folder: Path) -> str:
    """Return the prefix of the weights' keys in the folder: the one that most keys agree with."""
    counts: Counter[str] = Counter()
    for name in sizes:
        parts = name.split(".")
        for at in range(len(parts)):
            if ".".join(parts[at:]) in weights:
                counts["".join(f"{part}." for part in parts[:at])] += 1
                break
    # An optimizer's moments have the weights' names, too, with another prefix.
    prefixes = [prefix for prefix in counts if not prefix.startswith(("optim", "state"))]
    if not prefixes:
        raise DataError(f"{folder}: has no weight of this model; {_HINT}")
    return max(prefixes, key=lambda prefix: (counts[prefix], -len(prefix)))
