"""Checkpoints of policies, and the files beside their weights."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import torch
from tokenizers import Tokenizer

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.reading import read_json, require_file, require_plain_files
from model_adapters.hf.loading.checkpoint import (
    origin,
    resolve_device,
    resolve_dtype,
    versions,
    wrap_loading_errors,
)
from model_adapters.hf.loading.hub import fetch
from model_adapters.options.checkpoints import Placement

_HINT = "restore the checkpoint"

T = TypeVar("T")


class _ModelType(msgspec.Struct):
    model_type: str = "nameless"
    torch_dtype: str | None = None
    dtype: str | None = None


@dataclass(frozen=True)
class PolicyCheckpoint:
    """A policy's checkpoint on disk.

    Attributes:
        folder: folder of the checkpoint.
        pretrained: name of the checkpoint as the user gave it, for messages.
        origin: what identifies the weights, as JSON values.
    """

    folder: Path
    pretrained: str
    origin: dict[str, Any]

    def require_model_type(self, model_type: str) -> None:
        """Check that the checkpoint is of this family."""
        own_type = self._config().model_type
        if own_type != model_type:
            raise ModelError(
                f"{self.pretrained} is a {own_type} checkpoint, not {model_type}; see "
                "`infthor-eval ls models`"
            )

    def read(self, name: str, data_type: type[T]) -> T:
        """Read one of the JSON files as an instance of a type."""
        return read_json(self.folder / name, _HINT, data_type)

    def has_file(self, name: str) -> bool:
        """Return whether the checkpoint has this file."""
        return (self.folder / name).is_file()

    def tokenizer(self) -> Tokenizer:
        """Load the tokenizer from `tokenizer.json` directly; transformers would need the
        checkpoint's remote code.
        """
        path = self.folder / "tokenizer.json"
        require_file(path, _HINT)
        with wrap_loading_errors(self.pretrained):
            return Tokenizer.from_file(str(path))

    def resolve_placement(self, options: Placement) -> tuple[torch.device, torch.dtype]:
        """Return device and type of the weights; the type defaults to that of the config."""
        config = self._config()
        dtype = resolve_dtype(options)
        if isinstance(dtype, str):
            config_dtype = getattr(torch, config.dtype or config.torch_dtype or "", None)
            if not (isinstance(config_dtype, torch.dtype) and config_dtype.is_floating_point):
                raise UsageError(
                    f"the config of {self.pretrained} has no type of weights; give dtype="
                )
            dtype = config_dtype
        return resolve_device(options), dtype

    def identity(
        self, device: torch.device, dtype: torch.dtype, options: Placement
    ) -> dict[str, Any]:
        """Return everything that results depend on, as JSON values."""
        return self.origin | {
            "dtype": str(dtype).removeprefix("torch."),
            "device": device.type,
            "attn_implementation": options.attn_implementation,
            "versions": versions(),
        }

    def _config(self) -> _ModelType:
        return self.read("config.json", _ModelType)


def find_policy_checkpoint(pretrained: str, revision: str | None) -> PolicyCheckpoint:
    """Find or download a checkpoint."""
    folder, commit = fetch(pretrained, revision)
    require_plain_files(folder, _HINT)
    return PolicyCheckpoint(folder, pretrained, origin(folder, commit, pretrained))
