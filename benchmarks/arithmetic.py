"""The least time that a model's arithmetic takes on this machine, and where a run's time goes.

Only products of matrices and attention count. They are recorded while transformers alone computes
what is necessary, and each distinct one is timed by itself, on operands that lie ready: nothing
with the same model and kernels takes less than their sum.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import torch
from torch.profiler import ProfilerActivity, profile, record_function
from torch.utils._python_dispatch import TorchDispatchMode

__all__ = ["least_seconds", "parts_of", "record_products"]

_ATTENTION = ("scaled_dot_product_attention", "_scaled_dot_product", "_flash_attention")
_MATRICES = ("linear", "matmul", "mm", "addmm", "bmm", "baddbmm", "mkldnn_linear", "conv3d")
_SAMPLING = ("argmax", "topk", "sort", "multinomial", "log_softmax")
_VISION = "vision tower"
_LEAST_S = 0.02  # of the runs of one operation, of which the mean counts
_REPEATS = 3  # of those; the fastest counts


class Operand(NamedTuple):
    """A tensor that an operation is given."""

    shape: tuple[int, ...]
    strides: tuple[int, ...]
    dtype: torch.dtype
    device: torch.device

    @classmethod
    def of(cls, argument: Any) -> Any:
        """Return the operand of an argument; one that is no tensor as a value to count by."""
        if isinstance(argument, list):
            return tuple(argument)
        if not isinstance(argument, torch.Tensor):
            return argument
        return cls(tuple(argument.shape), argument.stride(), argument.dtype, argument.device)

    def drawn(self) -> torch.Tensor:
        """Return a tensor like it with drawn contents; a mask that hides nothing."""
        tensor = torch.empty_strided(self.shape, self.strides, dtype=self.dtype, device=self.device)
        return tensor.normal_() if self.dtype.is_floating_point else tensor.fill_(1)


class Product(NamedTuple):
    """A distinct product of matrices, or attention."""

    function: Any
    arguments: tuple[Any, ...]
    options: tuple[tuple[str, Any], ...]

    def seconds(self) -> float:
        """Return the time that it takes by itself."""
        arguments = [_drawn(argument) for argument in self.arguments]
        options = {name: _drawn(option) for name, option in self.options}
        self.function(*arguments, **options)
        best = float("inf")
        for _ in range(_REPEATS):
            start = time.perf_counter()
            n = 0
            while not n or time.perf_counter() - start < _LEAST_S:
                self.function(*arguments, **options)
                n += 1
            best = min(best, (time.perf_counter() - start) / n)
        return best


def _drawn(argument: Any) -> Any:
    return argument.drawn() if isinstance(argument, Operand) else argument


class _Recorder(TorchDispatchMode):
    """Counts products of matrices and attention."""

    def __init__(self) -> None:
        super().__init__()
        self.found: Counter[Product] = Counter()

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        options = kwargs or {}
        name = func.overloadpacket.__name__
        if name in _MATRICES or name.startswith(_ATTENTION):
            described = sorted((key, Operand.of(value)) for key, value in options.items())
            self.found[Product(func, tuple(map(Operand.of, args)), tuple(described))] += 1
        return func(*args, **options)


def record_products(run: Callable[[], Any]) -> Mapping[Product, int]:
    """Return how often each product is computed in a run."""
    with _Recorder() as recorder:
        run()
    return recorder.found


@torch.inference_mode()
def least_seconds(products: Mapping[Product, int]) -> float:
    """Return the time of all products, each at the rate of this machine for its shapes."""
    return sum(n * product.seconds() for product, n in products.items())


def parts_of(vision: torch.nn.Module, run: Callable[[], Any]) -> dict[str, float]:
    """Return the shares of a run's time by what it is spent on; they sum up to 1.

    Args:
        vision: the vision tower, whose operations are one part.
        run: the run.
    """
    with _named(vision), profile(activities=[ProfilerActivity.CPU]) as profiler:
        start = time.perf_counter()
        run()
        total = time.perf_counter() - start
    parts = dict.fromkeys((_VISION, "matrices", "attention", "sampling", "other operations"), 0.0)
    within = [it.time_range for it in profiler.events() if it.name == _VISION]
    for event in profiler.events():
        if event.name.startswith("aten::") and not any(
            span.start <= event.time_range.start < span.end for span in within
        ):
            parts[_part(event.name.removeprefix("aten::"))] += event.self_cpu_time_total / 1e6
    parts[_VISION] = sum(span.end - span.start for span in within) / 1e6
    parts["Python"] = max(0.0, total - sum(parts.values()))
    return {name: seconds / sum(parts.values()) for name, seconds in parts.items()}


def _part(name: str) -> str:
    if name in _MATRICES:
        return "matrices"
    if name.startswith(_ATTENTION):
        return "attention"
    return "sampling" if name in _SAMPLING else "other operations"


@contextmanager
def _named(vision: torch.nn.Module) -> Iterator[None]:
    """Let the profiler know when the vision tower computes."""
    forward = vision.forward

    def named(*args: Any, **kwargs: Any) -> Any:
        with record_function(_VISION):
            return forward(*args, **kwargs)

    vision.forward = named  # type: ignore[method-assign]
    try:
        yield
    finally:
        vision.forward = forward  # type: ignore[method-assign]
