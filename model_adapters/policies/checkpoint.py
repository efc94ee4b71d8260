"""Finding a policy's checkpoint and reading what stands beside its weights."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import torch
from tokenizers import Tokenizer

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.reading import read_json, require_file, require_plain_files
from model_adapters.hf.checkpoint import loading, origin, resolve_device, resolve_dtype, versions
from model_adapters.hf.hub import fetch
from model_adapters.options.checkpoints import Placement

__all__ = ["PolicyCheckpoint", "find"]

MEND = "restore the checkpoint"

T = TypeVar("T")


class _Kind(msgspec.Struct):
    model_type: str = "nameless"
    torch_dtype: str | None = None
    dtype: str | None = None


@dataclass(frozen=True)
class PolicyCheckpoint:
    """A policy's checkpoint in a folder.

    Attributes:
        folder: where it lies.
        pretrained: what was asked for, for messages.
        origin: what identifies its weights, as JSON values.
    """

    folder: Path
    pretrained: str
    origin: dict[str, Any]

    def require_kind(self, model_type: str) -> None:
        """Refuse a checkpoint of another family.

        Raises:
            ModelError: names the family.
            DataError: its config cannot be read.
        """
        found = self._kind().model_type
        if found != model_type:
            raise ModelError(
                f"{self.pretrained} is a {found} checkpoint, not {model_type}; see `infthor-eval ls models`"
            )

    def read(self, name: str, form: type[T]) -> T:
        """One of its JSON files, in the form of a type.

        Raises:
            DataError: it is missing, no JSON, or of another form.
        """
        return read_json(self.folder / name, MEND, form)

    def has(self, name: str) -> bool:
        """Whether it has a file."""
        return (self.folder / name).is_file()

    def tokenizer(self) -> Tokenizer:
        """Its tokenizer, from `tokenizer.json` itself: transformers would ask to run the checkpoint's code.

        Raises:
            DataError: there is no such file.
            ModelError: it is damaged.
        """
        path = self.folder / "tokenizer.json"
        require_file(path, MEND)
        with loading(self.pretrained):
            return Tokenizer.from_file(str(path))

    def placed(self, options: Placement) -> tuple[torch.device, torch.dtype]:
        """Device and type of the weights; the type that the config names where none is asked for.

        Raises:
            UsageError: there is no such device or type.
            ModelError: there is no GPU here.
        """
        kind = self._kind()
        dtype = resolve_dtype(options)
        if isinstance(dtype, str):
            named = getattr(torch, kind.dtype or kind.torch_dtype or "", None)
            if not (isinstance(named, torch.dtype) and named.is_floating_point):
                raise UsageError(f"{self.pretrained} names no type of weights; give dtype=")
            dtype = named
        return resolve_device(options), dtype

    def identity(self, device: torch.device, dtype: torch.dtype, options: Placement) -> dict[str, Any]:
        """What its numbers hang on, as JSON values."""
        return self.origin | {
            "dtype": str(dtype).removeprefix("torch."),
            "device": device.type,
            "attn_implementation": options.attn_implementation,
            "versions": versions(),
        }

    def _kind(self) -> _Kind:
        return self.read("config.json", _Kind)


def find(pretrained: str, revision: str | None) -> PolicyCheckpoint:
    """Find a checkpoint by its name.

    Args:
        pretrained: a hub id or a folder.
        revision: branch, tag or commit on the hub.

    Raises:
        ModelError: there is none, or it cannot be had.
    """
    folder, commit = fetch(pretrained, revision)
    require_plain_files(folder, MEND)
    return PolicyCheckpoint(folder, pretrained, origin(folder, commit, pretrained))
