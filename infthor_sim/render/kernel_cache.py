"""Invalidation of numba's cache of compiled kernels.

Numba recompiles a kernel when its own file changes, but not when a function or constant changes
that it takes from another file. A digest of all the kernels' sources beside the cache shows when
the cache is stale.
"""

import hashlib
from pathlib import Path

_SOURCES = (  # every file that compiled code comes from
    "camera.py", "creases_numba.py", "grouping_numba.py", "lighting.py", "patterns.py",
    "primitives.py", "probe_numba.py", "projection_numba.py", "raster_numba.py",
    "shading_numba.py", "smoothing_numba.py", "table.py",
)  # fmt: skip
_HERE = Path(__file__).parent


def drop_stale_kernels(folder: Path = _HERE) -> bool:
    """Remove kernels compiled from other sources than those in `folder`; return if any were."""
    content = b"".join((folder / name).read_bytes() for name in _SOURCES)
    sources = hashlib.blake2b(content, digest_size=16).hexdigest()
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
    except OSError:  # a read-only installation, whose files change all together
        return False
    return bool(stale)
