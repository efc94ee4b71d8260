"""A device that computes no numbers, so that a real model's code runs without weights or a GPU.

Floating-point tensors are torch's `meta` tensors: shapes alone. Integers and truth values (ids,
positions, grids, masks) keep their values on the CPU as long as they are small, because models
branch by them. What is allocated and freed on the device is added up as it happens.

Memory that a kernel takes within one operation is not seen, but for attention (`kernels`).
"""

import weakref
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import prod
from typing import Any

import torch
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves, tree_map

from model_adapters.hf.rehearsal.kernels import Attention, attention_of

DEVICE = torch.device("meta")
_CPU = torch.device("cpu")
_MOST_VALUES = (
    2**22
)  # elements of a tensor of integers whose values are kept; a longer mask's are not
# Choices by computed numbers, which are unknown here; experts of a mixture are chosen in turn.
# The place of the axis among each one's arguments.
_CHOICES = {"topk": 2, "sort": 1, "argsort": 1, "argmax": 1, "argmin": 1, "max": 1, "min": 1}


class ShapesDevice:
    """The device, and what happens on it.

    Attributes:
        allocated: bytes that are allocated now.
        peak: most bytes that were allocated at a time since `reset_peak`.
        attention: calls of attention, in order.
    """

    def __init__(self) -> None:
        self.allocated = 0
        self.peak = 0
        self.attention: list[Attention] = []
        self._storages: weakref.WeakSet[Any] = weakref.WeakSet()

    @contextmanager
    def running(self) -> Iterator[None]:
        """Run what is called within the context on the device, where it names it."""
        with _Functions(self), _Operations(self):
            yield

    def reset_peak(self) -> None:
        """Begin a new peak at what is allocated now."""
        self.peak = self.allocated

    def holds(self, tensor: torch.Tensor) -> bool:
        """Return whether a tensor lies on the device."""
        return tensor.is_meta or tensor.untyped_storage() in self._storages

    def take(self, tensor: torch.Tensor) -> None:
        """Count a tensor's memory from now on, until it is freed."""
        storage = tensor.untyped_storage()
        if storage in self._storages:
            return
        self._storages.add(storage)
        n_bytes = storage.nbytes()
        self.use(n_bytes)
        self.allocated += n_bytes
        weakref.finalize(storage, self._free, n_bytes)

    def use(self, n_bytes: int) -> None:
        """Count memory that an operation takes for itself alone."""
        self.peak = max(self.peak, self.allocated + n_bytes)

    def _free(self, n_bytes: int) -> None:
        self.allocated -= n_bytes


class _Functions(TorchFunctionMode):
    """What torch does before it dispatches operations: tensors of Python's numbers, attention."""

    def __init__(self, device: ShapesDevice) -> None:
        super().__init__()
        self._device = device

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        if func is torch.nn.functional.scaled_dot_product_attention:
            return self._attend(*args, **kwargs)
        if func in (torch.tensor, torch.as_tensor) and _is_device(kwargs.get("device")):
            return func(*args, **kwargs | {"device": _CPU}).to(DEVICE)
        return func(*args, **kwargs)

    def _attend(
        self,
        query: torch.Tensor,
        key: torch.Tensor,
        value: torch.Tensor,
        attn_mask: torch.Tensor | None = None,
        dropout_p: float = 0.0,
        is_causal: bool = False,
        scale: float | None = None,
        enable_gqa: bool = False,
    ) -> torch.Tensor:
        call = attention_of(query, key, value, attn_mask, is_causal, enable_gqa)
        self._device.attention.append(call)
        self._device.use(call.own_bytes)
        return query.new_empty((*query.shape[:-1], value.shape[-1]))


class _Operations(TorchDispatchMode):
    """Operations of torch: on integers with values, on everything else by shapes."""

    def __init__(self, device: ShapesDevice) -> None:
        super().__init__()
        self._device = device

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        tensors = [leaf for leaf in tree_leaves((args, kwargs)) if isinstance(leaf, torch.Tensor)]
        # A tensor that is here stays here: integers say that they are on the CPU, so that models
        # bring others to where they are.
        if not _is_device(kwargs.get("device")) and not any(map(self._device.holds, tensors)):
            return func(*args, **kwargs)
        if kwargs.get("device") is not None:
            kwargs = kwargs | {"device": DEVICE}
        out = self._run(func, args, kwargs, tensors)
        for tensor in tree_leaves(out):
            if isinstance(tensor, torch.Tensor):
                self._device.take(tensor)
        return out

    def _run(self, func: Any, args: Any, kwargs: Any, tensors: Sequence[torch.Tensor]) -> Any:
        name = func._schema.name.removeprefix("aten::")
        if tensors and name not in _CHOICES and all(tensor.is_meta for tensor in tensors):
            return func(*args, **kwargs)
        if all(_has_values(tensor) for tensor in tensors):
            return _with_values(func, args, kwargs, tensors)
        if name in ("index", "index_put", "index_put_"):
            args = (args[0], _counted(args[1]), *args[2:])
        out = func(*tree_map(_shape, args), **tree_map(_shape, kwargs))
        return _in_turn(out, _n_options(name, args)) if name in _CHOICES else out


def _with_values(func: Any, args: Any, kwargs: Any, tensors: Sequence[torch.Tensor]) -> Any:
    """Compute on integers; only the shape of what is no integer or has too many elements."""
    if not tensors or "dtype" in kwargs or _n_elements(tensors) > _MOST_VALUES:
        shapes = func(*tree_map(_shape, args), **tree_map(_shape, kwargs))
        if not all(map(_is_small_integer, tree_leaves(shapes))):
            return shapes
    if "device" in kwargs:
        kwargs = kwargs | {"device": _CPU}
    if func._schema.name == "aten::histc":  # a CPU counts no integers
        return func(args[0].double(), *args[1:], **kwargs).to(args[0].dtype)
    out = func(*args, **kwargs)
    return tree_map(lambda leaf: leaf if _is_small_integer(leaf) else _shape(leaf), out)


def _n_elements(tensors: Sequence[torch.Tensor]) -> int:
    """Return the elements of what an operation on each pair of elements returns."""
    try:
        return prod(torch.broadcast_shapes(*(tensor.shape for tensor in tensors)))
    except RuntimeError:  # they are not paired
        return max(tensor.numel() for tensor in tensors)


def _is_small_integer(leaf: Any) -> bool:
    if not isinstance(leaf, torch.Tensor):
        return True
    return not (leaf.is_floating_point() or leaf.is_complex()) and leaf.numel() <= _MOST_VALUES


def _has_values(tensor: torch.Tensor) -> bool:
    return not (tensor.is_meta or tensor.is_floating_point() or tensor.is_complex())


def _is_device(device: Any) -> bool:
    return device is not None and torch.device(device).type == DEVICE.type


def _shape(leaf: Any) -> Any:
    """Return a tensor of the same shape without values."""
    if not isinstance(leaf, torch.Tensor) or leaf.is_meta:
        return leaf
    return torch.empty_strided(leaf.shape, leaf.stride(), dtype=leaf.dtype, device=DEVICE)


def _counted(indices: Sequence[torch.Tensor | None]) -> list[torch.Tensor | None]:
    """Return indices in which truth values are replaced by the indices of those that are true."""
    counted: list[torch.Tensor | None] = []
    for index in indices:
        if index is not None and index.dtype == torch.bool and not index.is_meta:
            counted += index.nonzero(as_tuple=True)
        else:
            counted.append(index)
    return counted


def _n_options(name: str, args: Sequence[Any]) -> int:
    at = _CHOICES[name]
    axis = args[at] if len(args) > at and isinstance(args[at], int) else -1
    return int(args[0].shape[axis]) if args[0].dim() else 1


def _in_turn(out: Any, n_options: int) -> Any:
    """Return a choice's results with values for its indices: each option in turn."""

    def fill(leaf: Any) -> Any:
        if not isinstance(leaf, torch.Tensor) or leaf.is_floating_point():
            return leaf
        return (torch.arange(leaf.numel()) % n_options).to(leaf.dtype).reshape(leaf.shape)

    return tree_map(fill, out)
