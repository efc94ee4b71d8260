"""Keeps numba's cache of compiled kernels true to the sources.

Numba recompiles a kernel when its own file changes, but not when a function or constant that it takes from another
file does. A stamp of all the kernels' sources beside the cache tells when it is stale.
"""

from pathlib import Path

from infthor_eval.formats.digests import digest

__all__ = ["drop_stale_kernels"]

_SOURCES = (
    "camera.py", "glimpse_numba.py", "lighting.py", "patterns.py", "primitives.py", "raster_numba.py",
    "shading_numba.py", "smoothing.py", "smoothing_numba.py",
)  # fmt: skip
_HERE = Path(__file__).parent


def drop_stale_kernels(folder: Path = _HERE) -> bool:
    """Remove compiled kernels that were made from other sources than those in `folder`; whether there were any."""
    sources = digest(b"".join((folder / name).read_bytes() for name in _SOURCES))
    cache = folder / "__pycache__"
    stamp = cache / "kernels.stamp"
    if stamp.exists() and stamp.read_text(encoding="ascii") == sources:
        return False
    try:
        stale = [*cache.glob("*_numba.*.nbi"), *cache.glob("*_numba.*.nbc")]
        for path in stale:
            path.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        stamp.write_text(sources, encoding="ascii")
    except OSError:  # a read-only installation: its files change together, with an upgrade
        return False
    return bool(stale)
