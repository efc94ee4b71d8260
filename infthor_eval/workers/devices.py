"""A worker's share of its machine: processor threads and GPUs."""

import os
from pathlib import Path

__all__ = ["gpus", "own_devices"]

_VISIBLE = "CUDA_VISIBLE_DEVICES"
_THREADS = "OMP_NUM_THREADS"
_DRIVER = Path("/proc/driver/nvidia/gpus")


def gpus() -> list[str]:
    """The GPUs that this process may use, as CUDA names them; found without importing torch, which would hold them."""
    visible = os.environ.get(_VISIBLE)
    if visible is not None:
        return [name.strip() for name in visible.split(",") if name.strip()]
    return [str(number) for number in range(len(list(_DRIVER.iterdir())))] if _DRIVER.is_dir() else []


def own_devices(number: int, count: int) -> None:
    """Leave this process its share; what the environment says of threads already stands.

    Args:
        number: of the worker, from 1.
        count: how many workers there are.
    """
    os.environ.setdefault(_THREADS, str(max(1, (os.cpu_count() or 1) // count)))
    every = gpus()
    if every and count > 1:
        os.environ[_VISIBLE] = ",".join(every[(number - 1) % len(every) :: count])
