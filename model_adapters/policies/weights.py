"""From the files of a checkpoint to a module's parameters, every key accounted for.

A checkpoint's file and the module that reads it were written by different people at different times. So what the file
has to hold is derived from the module, and anything missing, unknown or of another shape ends the loading: a part that
stays random is seen in no number and spoils all of them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from accelerate import init_empty_weights
from safetensors import safe_open
from torch import nn

from infthor_eval.errors import ModelError

__all__ = ["Layout", "Shape", "empty", "load_weights"]

Shape = tuple[int, ...]

_NAMED = 3  # keys that an error names


@contextmanager
def empty() -> Iterator[None]:
    """Modules made within have parameters without memory, but real buffers.

    Buffers are computed where a module is made and stand in no file; on the meta device they would be lost.
    """
    with init_empty_weights(include_buffers=False):
        yield


@dataclass(frozen=True)
class Layout:
    """What the files of a checkpoint hold.

    Attributes:
        parameters: keys of what the module reads, with the names of its parameters.
        shapes: of these keys.
        unused: keys that belong to the architecture and that no action depends on, with their shapes.
    """

    parameters: Mapping[str, str]
    shapes: Mapping[str, Shape]
    unused: Mapping[str, Shape]

    @classmethod
    def of(cls, module: nn.Module, key_of: Callable[[str], str | None], unused: Mapping[str, Shape]) -> "Layout":
        """The layout of a module's checkpoint.

        Args:
            module: its parameters need no memory.
            key_of: the key of a parameter, by its name; None where the parameter is another's and has no key.
            unused: see above.
        """
        found = {key: (name, value) for name, value in module.state_dict().items() if (key := key_of(name)) is not None}
        return cls(
            {key: name for key, (name, _) in found.items()},
            {key: tuple(value.shape) for key, (_, value) in found.items()},
            unused,
        )

    def expected(self) -> dict[str, Shape]:
        """All keys, used and unused, with their shapes."""
        return {**self.shapes, **self.unused}

    def check(self, found: Mapping[str, Shape], pretrained: str) -> None:
        """Refuse files that hold anything else than this.

        Args:
            found: their keys with shapes.
            pretrained: the checkpoint, for the message.

        Raises:
            ModelError: names the first keys that are missing, unknown or of another shape, and how many there are.
        """
        expected = self.expected()
        faults = {
            "lacks": sorted(expected.keys() - found.keys()),
            "holds unknown": sorted(found.keys() - expected.keys()),
            "has another shape in": [
                f"{key} {list(found[key])} instead of {list(shape)}"
                for key, shape in sorted(expected.items())
                if key in found and found[key] != shape
            ],
        }
        said = [f"{fault} {_first(keys)}" for fault, keys in faults.items() if keys]
        if said:
            raise ModelError(
                f"the weights of {pretrained} are not this architecture's: the checkpoint {'; '.join(said)}"
            )


def load_weights(
    module: nn.Module, folder: Path, layout: Layout, *, pretrained: str, device: torch.device, dtype: torch.dtype
) -> None:
    """Read a checkpoint's safetensors files into a module, a tensor at a time.

    Args:
        module: made within `empty()`; it ends up on the device, its parameters in the dtype, its buffers as they are.
        folder: with the files.
        layout: what they must hold.
        pretrained: the checkpoint, for messages.
        device: where the parameters go.
        dtype: their type.

    Raises:
        ModelError: there are no files, or they hold anything else than the layout says.
    """
    paths = sorted(folder.glob("*.safetensors"))
    if not paths:
        raise ModelError(f"{pretrained} has no *.safetensors file; give a checkpoint with weights in that format")
    with ExitStack() as opened:
        files = [opened.enter_context(safe_open(path, framework="pt")) for path in paths]
        place = _places(files, pretrained)
        layout.check({key: tuple(file.get_slice(key).get_shape()) for key, file in place.items()}, pretrained)
        for key, name in layout.parameters.items():
            tensor = place[key].get_tensor(key)
            if not tensor.is_floating_point():
                raise ModelError(f"{key} of {pretrained} is {tensor.dtype}; quantised weights are not supported")
            _assign(module, name, tensor.to(device, dtype))
    # Not the whole module: a parameter without a key of its own has no memory yet.
    for part in module.modules():
        for name, buffer in part.named_buffers(recurse=False):
            setattr(part, name, buffer.to(device))


def _places(files: Sequence[Any], pretrained: str) -> dict[str, Any]:
    """The file of each key."""
    place: dict[str, Any] = {}
    for file in files:
        for key in file.keys():  # noqa: SIM118  # it is no mapping
            if key in place:
                raise ModelError(f"two files of {pretrained} hold {key}; keep the files of one checkpoint in a folder")
            place[key] = file
    return place


def _assign(module: nn.Module, name: str, tensor: torch.Tensor) -> None:
    owner, _, attribute = name.rpartition(".")
    setattr(module.get_submodule(owner), attribute, nn.Parameter(tensor, requires_grad=False))


def _first(keys: Sequence[str]) -> str:
    more = f", ... ({len(keys)} in all)" if len(keys) > _NAMED else ""
    return ", ".join(keys[:_NAMED]) + more
