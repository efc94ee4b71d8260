"""Vectors by key in a file that several processes may read and extend at the same time."""

import fcntl
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from infthor_eval.errors import wrap_errors

_DIGITS = 6  # digits of a similarity; rounding errors beyond must not decide between equal vectors


class VectorFile:
    """An append-only file of float32 vectors; only the keys are in memory, so millions of vectors
    cost little."""

    def __init__(self, path: Path, width: int) -> None:
        """Open the file, or create it and its folder; `width` is the dimensions of a vector."""
        self._row_type = np.dtype([("key", "S32"), ("vector", "<f4", (width,))])
        self._rows: dict[str, int] = {}
        self._n_rows = 0
        with wrap_errors(f"{path}: cannot be written", "set XDG_CACHE_HOME"):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a+b")
        self._read_new_keys()

    def __contains__(self, key: str) -> bool:
        return key in self._rows

    def add(self, keys: Sequence[str], vectors: np.ndarray) -> None:
        """Append vectors.

        Args:
            keys: keys of 32 ASCII characters each; if another process has added a key meanwhile,
                its vector is kept.
            vectors: vectors, (keys, width).
        """
        rows = np.zeros(len(keys), self._row_type)
        rows["key"] = keys
        rows["vector"] = vectors
        fcntl.flock(self._file, fcntl.LOCK_EX)
        try:
            with wrap_errors(f"{self._file.name}: cannot be written", "free some space"):
                size = os.fstat(self._file.fileno()).st_size
                # Drops a killed process's unfinished row.
                self._file.truncate(size - size % self._row_type.itemsize)
                self._file.write(rows.tobytes())
                self._file.flush()
        finally:
            fcntl.flock(self._file, fcntl.LOCK_UN)
        self._read_new_keys()

    def get(self, keys: Sequence[str]) -> np.ndarray:
        """Return the vectors of known keys, (keys, width)."""
        return np.asarray(self._map_rows()["vector"][[self._rows[key] for key in keys]])

    def _read_new_keys(self) -> None:
        """Read the keys of rows that this or another process has added."""
        rows = self._map_rows()
        for row, key in enumerate(rows["key"][self._n_rows :].tolist(), self._n_rows):
            self._rows.setdefault(key.decode(), row)
        self._n_rows = len(rows)

    def _map_rows(self) -> np.ndarray:
        n_rows = os.fstat(self._file.fileno()).st_size // self._row_type.itemsize
        if not n_rows:  # an empty file cannot be mapped
            return np.zeros(0, self._row_type)
        return np.memmap(self._file, self._row_type, mode="r", shape=(n_rows,))


def nearest(vectors: np.ndarray, query: np.ndarray, top_k: int) -> tuple[int, ...]:
    """Return the `top_k` rows with the largest cosine, in ascending order of their numbers.

    Both vectors, (rows, dimensions), and the query, (dimensions,), have length 1.
    """
    similarity = np.round(vectors.astype(np.float64) @ query.astype(np.float64), _DIGITS)
    order = np.argsort(-similarity, kind="stable")
    return tuple(sorted(order[:top_k].tolist()))
