"""Import of the published trainer's checkpoints: torch's distributed ones, of models of the hub.

Of the published code, branch `dev` alone exports them, and Qwen2.5-VL alone. Here their weights are
put into the model that training started from, which is then written like any other checkpoint.

The published trainer writes `step-N/` with `.metadata` and `*.distcp`, under keys `model.*`,
`optimizer.*`, `train_state.*` and so on, or the weights alone under their own names. Its READMEs
name folders `checkpoints/NAME` of the hub's `PEARLS-Lab/infini-thor`, which hold those files.
"""

import pickle
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.distributed.checkpoint as dcp
from torch.distributed.checkpoint.metadata import Metadata, StorageMeta, TensorStorageMetadata
from transformers.core_model_loading import revert_weight_conversion

from infthor_eval.errors import DataError, wrap_errors
from model_adapters.hf.loading.hub import fetch
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.loading.tower_names import published_name

_DTYPES = {name for name in dir(torch) if isinstance(getattr(torch, name), torch.dtype)}
# What the pickle `.metadata` may name, by module: it may come from the hub, and a pickle that may
# name anything runs code.
_HARMLESS = {
    "collections": {"OrderedDict"},
    "pathlib": {"PosixPath"},
    "torch": {"Size", *_DTYPES},
    "torch.distributed.checkpoint.filesystem": {"_StorageInfo"},
    "torch.distributed.checkpoint.metadata": {
        "BytesStorageMetadata",
        "ChunkStorageMetadata",
        "Metadata",
        "MetadataIndex",
        "StorageMeta",
        "TensorProperties",
        "TensorStorageMetadata",
        "_MEM_FORMAT_ENCODING",
    },
    "torch.serialization": {"_get_layout"},
}
_HINT = "give a folder with .metadata and *.distcp files of the model that --model names"


@dataclass(frozen=True)
class ImportedWeights:
    """Numbers of imported tensors.

    Attributes:
        n_imported: weights that the folder has.
        n_kept: weights of the model that the folder does not have; they stay those of the initial
            checkpoint.
        n_ignored: tensors of the folder that are not weights (an optimizer's).
    """

    n_imported: int
    n_kept: int
    n_ignored: int


def find_weights(place: str, revision: str | None = None) -> Path:
    """Return the folder of a distributed checkpoint, downloading it unless it is there.

    Args:
        place: its folder, a folder of `step-N` of which the last is taken as in the published
            trainer, or such a folder of a hub's repository (`owner/name/folder`).
        revision: branch, tag or commit on the hub; the default branch where None.
    """
    folder, _ = fetch(place, revision, option="", extra_patterns=("*.distcp",))
    if (folder / ".metadata").is_file():
        return folder
    steps = {
        int(match[1]): path
        for path in folder.iterdir()
        if (match := re.fullmatch(r"step-(\d+)", path.name)) and (path / ".metadata").is_file()
    }
    return steps[max(steps)] if steps else folder


def import_weights(loaded: LoadedCheckpoint, folder: Path) -> ImportedWeights:
    """Load the weights of a distributed checkpoint into a model.

    The keys of all weights may have one common prefix ("model.", "app.model."), and the names that
    weights have in the hub's files, as in transformers 4.49.

    Args:
        loaded: the model that training started from, with the marks of sequences as tokens.
        folder: folder of the checkpoint.
    """
    with wrap_errors(f"{folder}: not a distributed checkpoint", _HINT, catch=Exception):
        reader = _Reader(folder)
        stored: Mapping[str, Any] = reader.read_metadata().state_dict_metadata
        sizes = {
            name: entry.size
            for name, entry in stored.items()
            if isinstance(entry, TensorStorageMetadata)
        }
    weights = loaded.model.state_dict()
    stored_names = _stored_names(sizes, loaded.model, folder)
    for name, key in stored_names.items():
        if sizes[key] != weights[name].shape:
            raise DataError(
                f"{folder}: {key} is {tuple(sizes[key])}, the model's "
                f"{tuple(weights[name].shape)}; training started from another checkpoint, or with "
                "other tokens"
            )
    tensors = {key: torch.empty_like(weights[name]) for name, key in stored_names.items()}
    with wrap_errors(f"{folder}: cannot be read", "restore its files", catch=Exception):
        dcp.load(tensors, storage_reader=reader, no_dist=True)
    loaded.model.load_state_dict(
        {name: tensors[key] for name, key in stored_names.items()}, strict=False
    )
    n_imported = len(stored_names)
    return ImportedWeights(n_imported, len(weights) - n_imported, len(sizes) - n_imported)


class _MetadataUnpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if name not in _HARMLESS.get(module, ()):
            raise pickle.UnpicklingError(f".metadata names {module}.{name}, which may run code")
        return super().find_class(module, name)


class _Reader(dcp.FileSystemReader):
    """A reader that unpickles nothing which could run code; torch reads the tensors so, too."""

    def read_metadata(self, *args: Any, **kwargs: Any) -> Metadata:
        """See `dcp.FileSystemReader`."""
        with (Path(self.path) / ".metadata").open("rb") as file:
            metadata: Metadata = _MetadataUnpickler(file).load()
        if metadata.storage_meta is None:
            metadata.storage_meta = StorageMeta()
        metadata.storage_meta.load_id = self.load_id
        return metadata


def _stored_names(sizes: Mapping[str, Any], model: Any, folder: Path) -> Mapping[str, str]:
    """Return the keys in the folder of the model's weights, by the weights' names.

    The published trainer had transformers 4.49, in which models name their weights as the hub's
    files do; later ones name them otherwise. The names that more keys have are taken.
    """
    weights = model.state_dict()
    of_hub = {
        id(tensor): published_name(name)
        for name, tensor in revert_weight_conversion(model, dict(weights)).items()
    }
    tables = [
        {name: name for name in weights},
        {of_hub[id(weight)]: name for name, weight in weights.items() if id(weight) in of_hub},
    ]
    prefixed = max((_with_prefix(sizes, table) for table in tables), key=len)
    if not prefixed:
        raise DataError(f"{folder}: has no weight of this model; {_HINT}")
    return prefixed


def _with_prefix(sizes: Mapping[str, Any], names: Mapping[str, str]) -> Mapping[str, str]:
    """Return the keys of weights that have the prefix that most keys agree with; `names` are those
    that it precedes."""
    counts: Counter[str] = Counter()
    for key in sizes:
        parts = key.split(".")
        for at in range(len(parts)):
            if ".".join(parts[at:]) in names:
                counts["".join(f"{part}." for part in parts[:at])] += 1
                break
    # An optimizer's moments have the weights' names, too, with another prefix.
    prefixes = [prefix for prefix in counts if not prefix.startswith(("optim", "state"))]
    if not prefixes:
        return {}
    prefix = max(prefixes, key=lambda prefix: (counts[prefix], -len(prefix)))
    keys = {key.removeprefix(prefix): key for key in sizes if key.startswith(prefix)}
    return {name: keys[stored] for stored, name in names.items() if stored in keys}
