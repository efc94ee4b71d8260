"""Strict loading of a checkpoint's files into a module.

A checkpoint and the module that reads it were written by different people at different times. So
the expected keys are derived from the module, and a key that is missing, unknown or of another
shape is an error: a part that silently stayed random would spoil all results.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from typing import Any

import torch
from accelerate import init_empty_weights
from safetensors import safe_open
from torch import nn

from infthor_eval.errors import ModelError
from model_adapters.policies.checkpoint import PolicyCheckpoint

Shape = tuple[int, ...]

_MOST_KEYS = 3  # keys that an error lists


def empty_parameters() -> AbstractContextManager[None]:
    """Create modules whose parameters take no memory, but whose buffers are real.

    Buffers are computed when a module is created and are not in a checkpoint; on the meta device
    they would be lost.
    """
    created: AbstractContextManager[None] = init_empty_weights(include_buffers=False)
    return created


@dataclass(frozen=True)
class Layout:
    """Keys in the files of a checkpoint.

    Attributes:
        parameters: keys that the module reads, each with the name of its parameter.
        shapes: shapes of these keys.
        unused: shapes of further keys of the architecture, which no action depends on.
    """

    parameters: Mapping[str, str]
    shapes: Mapping[str, Shape]
    unused: Mapping[str, Shape]

    @classmethod
    def of(
        cls, module: nn.Module, key_of: Callable[[str], str | None], unused: Mapping[str, Shape]
    ) -> "Layout":
        """Return the layout of a module's checkpoint.

        Args:
            module: the module; its parameters need no memory.
            key_of: returns the key of a parameter by its name, or None if the parameter is tied to
                another.
            unused: see `Layout.unused`.
        """
        entries = {
            key: (name, value)
            for name, value in module.state_dict().items()
            if (key := key_of(name)) is not None
        }
        return cls(
            {key: name for key, (name, _) in entries.items()},
            {key: tuple(value.shape) for key, (_, value) in entries.items()},
            unused,
        )

    def all_shapes(self) -> dict[str, Shape]:
        """Return the shapes of all keys, used and unused."""
        return {**self.shapes, **self.unused}

    def check(self, actual: Mapping[str, Shape], pretrained: str) -> None:
        """Check that files have exactly these keys, in these shapes."""
        expected = self.all_shapes()
        faults = {
            "lacks": sorted(expected.keys() - actual.keys()),
            "has unknown": sorted(actual.keys() - expected.keys()),
            "has another shape in": [
                f"{key} {list(actual[key])} instead of {list(shape)}"
                for key, shape in sorted(expected.items())
                if key in actual and actual[key] != shape
            ],
        }
        complaints = [f"{fault} {_first_keys(keys)}" for fault, keys in faults.items() if keys]
        if complaints:
            raise ModelError(
                f"the weights of {pretrained} are not this architecture's: the checkpoint "
                f"{'; '.join(complaints)}"
            )


def load_weights(
    module: nn.Module,
    checkpoint: PolicyCheckpoint,
    layout: Layout,
    device: torch.device,
    dtype: torch.dtype,
) -> None:
    """Read a checkpoint's safetensors files into a module, one tensor at a time.

    Args:
        module: a module created within `empty_parameters()`. It ends up on the device; buffers keep
            their types.
        checkpoint: the checkpoint.
        layout: expected keys.
        device: device of the parameters.
        dtype: type of the parameters.
    """
    pretrained = checkpoint.pretrained
    paths = sorted(checkpoint.folder.glob("*.safetensors"))
    if not paths:
        raise ModelError(
            f"{pretrained} has no *.safetensors file; give a checkpoint with weights in that format"
        )
    with ExitStack() as stack:
        files = [stack.enter_context(safe_open(path, framework="pt")) for path in paths]
        file_of = _files_by_key(files, pretrained)
        layout.check(
            {key: tuple(file.get_slice(key).get_shape()) for key, file in file_of.items()},
            pretrained,
        )
        for key, name in layout.parameters.items():
            tensor = file_of[key].get_tensor(key)
            if not tensor.is_floating_point():
                raise ModelError(
                    f"{key} of {pretrained} is {tensor.dtype}; quantised weights are not supported"
                )
            _assign(module, name, tensor.to(device, dtype))
    # Not module.to(device): a tied parameter without a key has no memory yet, which `to` refuses.
    for part in module.modules():
        for name, buffer in part.named_buffers(recurse=False):
            setattr(part, name, buffer.to(device))


def _files_by_key(files: Sequence[Any], pretrained: str) -> dict[str, Any]:
    """Return the file of each key."""
    file_of: dict[str, Any] = {}
    for file in files:
        for key in file.keys():  # noqa: SIM118  # it is not a mapping
            if key in file_of:
                raise ModelError(
                    f"two files of {pretrained} have {key}; keep one checkpoint in a folder"
                )
            file_of[key] = file
    return file_of


def _assign(module: nn.Module, name: str, tensor: torch.Tensor) -> None:
    owner, _, attribute = name.rpartition(".")
    setattr(module.get_submodule(owner), attribute, nn.Parameter(tensor, requires_grad=False))


def _first_keys(keys: Sequence[str]) -> str:
    more = f", ... ({len(keys)} in all)" if len(keys) > _MOST_KEYS else ""
    return ", ".join(keys[:_MOST_KEYS]) + more
