"""Devices that are not the CPU, on any machine: what a GPU would refuse is refused, what it waits
for is counted.

Their tensors hold CPU tensors and say that they are torch's `meta` device, which every build of
torch has, with a number. They compute what the CPU computes, so that replies can be compared; but
as on GPUs, two devices do not meet in one operation, and what is read or copied from one to the
other is seen.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import torch
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode, _disable_current_modes
from torch.utils._pytree import tree_leaves, tree_map

__all__ = ["Seen", "elsewhere", "move"]

_HERE, _ELSEWHERE = torch.device("cpu"), torch.device("meta", 0)
_MOVES = {"_to_copy", "copy_", "to"}
_READS = {
    "_local_scalar_dense",
    "equal",
    "is_nonzero",
    "masked_select",
    "nonzero",
    "unique_dim",
    "_unique2",
}


@dataclass
class Seen:
    """What happened on the device, by the name of the operation.

    Attributes:
        reads: how often something was read from it, which waits for all that it has been given to
            do.
        brought: how often something was brought to it.
        allocated: bytes of new memory; what attention takes within itself depends on the kernel and
            is left out.
    """

    reads: Counter[str] = field(default_factory=Counter)
    brought: Counter[str] = field(default_factory=Counter)
    allocated: Counter[str] = field(default_factory=Counter)


class _Elsewhere(torch.Tensor):
    """A tensor on the device."""

    held: torch.Tensor
    seen: Seen
    place: torch.device
    is_meta = False  # it has values

    @staticmethod
    def __new__(
        cls, held: torch.Tensor, seen: Seen, device: torch.device = _ELSEWHERE
    ) -> "_Elsewhere":
        tensor: _Elsewhere = torch.Tensor._make_wrapper_subclass(
            cls,
            held.shape,
            strides=held.stride(),
            storage_offset=held.storage_offset(),
            dtype=held.dtype,
            device=_ELSEWHERE,
        )
        tensor.held, tensor.seen, tensor.place = held, seen, device
        return tensor

    @property
    def device(self) -> torch.device:  # type: ignore[override]  # torch's has no number
        return self.place

    @classmethod
    def __torch_function__(cls, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        # What torch does in C++ before it dispatches anything.
        if func in (torch.Tensor.__getitem__, torch.Tensor.__setitem__):
            return _indexed(func, args)
        if func is torch.Tensor.tolist:
            args[0].seen.reads["tolist"] += 1
            return args[0].held.tolist()
        if func is torch.Tensor.__format__:
            args[0].seen.reads["printed"] += 1
            return format(args[0].held, *args[1:])
        if func is torch.nn.functional.scaled_dot_product_attention:
            return _attended(func, args, kwargs)
        with torch._C.DisableTorchFunctionSubclass():
            return func(*args, **kwargs)

    @classmethod
    def __torch_dispatch__(cls, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return _dispatched(func, args, kwargs or {})


def _ours(leaves: Sequence[Any]) -> list[_Elsewhere]:
    return [leaf for leaf in leaves if isinstance(leaf, _Elsewhere)]


def _require_one_device(name: Any, leaves: Sequence[Any]) -> None:
    devices = {tensor.device for tensor in _ours(leaves)}
    devices |= {tensor.device for tensor in _theirs(leaves) if tensor.dim()}
    if len(devices) > 1:
        raise RuntimeError(f"{name} of tensors on {len(devices)} devices")


def _theirs(leaves: Sequence[Any]) -> list[torch.Tensor]:
    return [
        leaf
        for leaf in leaves
        if isinstance(leaf, torch.Tensor) and not isinstance(leaf, _Elsewhere)
    ]


def _plain(leaf: Any) -> Any:
    if isinstance(leaf, _Elsewhere):
        return leaf.held
    return _HERE if isinstance(leaf, torch.device) else leaf


def _storage(tensor: torch.Tensor) -> int:
    return tensor.untyped_storage().data_ptr()


def _wrapped(
    out: Any, ours: Sequence[_Elsewhere], seen: Seen, name: str, device: torch.device
) -> Any:
    """Results as tensors of the device; what an operation wrote in place is the tensor that was
    given."""
    known = {_storage(tensor.held) for tensor in ours}

    def wrap(leaf: Any) -> Any:
        if not isinstance(leaf, torch.Tensor):
            return leaf
        for tensor in ours:
            if tensor.held is leaf and tensor.device == device:
                return tensor
        if _storage(leaf) not in known:
            seen.allocated[name] += leaf.untyped_storage().nbytes()
        return _Elsewhere(leaf, seen, device)

    return tree_map(wrap, out)


def _target(
    func: Any, args: Sequence[Any], leaves: Sequence[Any], ours: Sequence[_Elsewhere]
) -> torch.device:
    """Where the result of an operation lies."""
    if func._overloadname == "other":
        return args[1].device  # type: ignore[no-any-return]
    if func._schema.name == "aten::copy_":
        return args[0].device  # type: ignore[no-any-return]
    named = [leaf for leaf in leaves if isinstance(leaf, torch.device)]
    # torch leaves the number out where it names the device of a given tensor itself.
    if named and (named[0] == _HERE or named[0].index is not None):
        return named[0]
    return ours[0].device if ours else _HERE


def _dispatched(
    func: Any, args: Sequence[Any], kwargs: Mapping[str, Any], seen: Seen | None = None
) -> Any:
    """Carry out one operation of torch."""
    leaves, name = tree_leaves((args, kwargs)), func._schema.name.removeprefix("aten::")
    ours, theirs = _ours(leaves), _theirs(leaves)
    if ours and name not in _MOVES:
        _require_one_device(func, leaves)
    seen = ours[0].seen if ours else seen
    target = _target(func, args, leaves, ours)
    if name == "histc" and ours:  # of whole numbers, too, on a GPU
        out = func(args[0].held.float(), *args[1:], **kwargs).to(args[0].dtype)
    else:
        out = func(*tree_map(_plain, args), **tree_map(_plain, kwargs))
    if seen is None:
        return out
    seen.reads[name] += bool(ours) and (name in _READS or (name in _MOVES and target == _HERE))
    seen.brought[name] += bool(theirs) and name in _MOVES and target != _HERE
    return out if target == _HERE else _wrapped(out, ours, seen, name, target)


def _indexed(func: Callable[..., Any], args: Sequence[Any]) -> Any:
    """`x[index]` and `x[index] = value`."""
    leaves = tree_leaves(args)
    ours, target = _ours(leaves), args[0]
    seen, index = ours[0].seen, args[1] if isinstance(args[1], tuple) else (args[1],)
    seen.reads["mask"] += sum(
        isinstance(part, _Elsewhere) and part.dtype == torch.bool for part in index
    )
    if func is torch.Tensor.__getitem__ or any(isinstance(part, torch.Tensor) for part in index):
        _require_one_device("an index", ours)
    if isinstance(target, _Elsewhere):
        seen.brought["index"] += sum(isinstance(part, list) for part in index) + len(
            _theirs(leaves)
        )
    else:
        seen.reads["written out"] += 1
    with torch._C.DisableTorchFunction():
        out = func(*tree_map(_plain, args))
    return (
        out
        if out is None or not isinstance(target, _Elsewhere)
        else _wrapped(out, ours, seen, "index", target.device)
    )


def _attended(func: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
    leaves = tree_leaves((args, kwargs))
    _require_one_device("attention", leaves)
    first = _ours(leaves)[0]
    with _disable_current_modes():
        out = func(*tree_map(_plain, args), **tree_map(_plain, kwargs))
    return _Elsewhere(out, first.seen, first.device)


class _Making(TorchFunctionMode):
    """Tensors that are made of Python's numbers on the device."""

    def __init__(self, seen: Seen) -> None:
        super().__init__()
        self._seen = seen

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs = kwargs or {}
        device = kwargs.get("device")
        if func not in (torch.tensor, torch.as_tensor) or device is None or device.type != "meta":
            return func(*args, **kwargs)
        tensor = func(*args, **(kwargs | {"device": None}))
        if isinstance(tensor, _Elsewhere):
            return tensor
        self._seen.brought["tensor"] += 1
        return _Elsewhere(tensor, self._seen, device)


class _Dispatching(TorchDispatchMode):
    """Operations that have no tensor of the device yet, such as `arange(device=...)`."""

    def __init__(self, seen: Seen) -> None:
        super().__init__()
        self._seen = seen

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return _dispatched(func, args, kwargs or {}, self._seen)


@contextmanager
def elsewhere(seen: Seen) -> Iterator[None]:
    """Where the device can be computed on."""
    with _Making(seen), _Dispatching(seen):
        yield


@torch.inference_mode()  # in which they are used: a view of another tensor cannot be made there
def move(module: torch.nn.Module, seen: Seen, device: torch.device = _ELSEWHERE) -> None:
    """Bring the parameters and buffers of a model, or of a part of it, to a device."""
    for part in module.modules():
        for tensors in (part._parameters, part._buffers):
            for name, tensor in tensors.items():
                if tensor is not None:
                    held = tensor.held if isinstance(tensor, _Elsewhere) else tensor.detach()
                    tensors[name] = _Elsewhere(held, seen, device)  # type: ignore[assignment]
