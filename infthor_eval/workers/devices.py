"""The share of a worker in its machine: processor threads and GPUs."""

import os
from pathlib import Path

__all__ = ["limit_devices", "visible_gpus"]

_VISIBLE = "CUDA_VISIBLE_DEVICES"
_THREADS = "OMP_NUM_THREADS"
_DRIVER = Path("/proc/driver/nvidia/gpus")


def visible_gpus() -> list[str]:
    """Return the GPUs that this process may use, as CUDA names them, without torch, which would
    occupy them."""
    visible = os.environ.get(_VISIBLE)
    if visible is not None:
        return [name.strip() for name in visible.split(",") if name.strip()]
    return (
        [str(number) for number in range(len(list(_DRIVER.iterdir())))] if _DRIVER.is_dir() else []
    )


def limit_devices(number: int, count: int) -> None:
    """Limit this process to the share of a worker (from 1) of `count`; a number of threads already
    set is kept."""
    os.environ.setdefault(_THREADS, str(max(1, (os.cpu_count() or 1) // count)))
    all_gpus = visible_gpus()
    if all_gpus and count > 1:
        os.environ[_VISIBLE] = ",".join(all_gpus[(number - 1) % len(all_gpus) :: count])
