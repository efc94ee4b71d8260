"""Vectors by key in a file, which several processes may read and add to at the same time."""

import fcntl
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from infthor_eval.errors import DataError

__all__ = ["VectorFile", "nearest"]

_DIGITS = 6  # of a similarity; what is beyond is rounding, which must not decide between equal vectors


class VectorFile:
    """An append-only file of float32 vectors. In memory are the keys alone, so millions of vectors cost little."""

    def __init__(self, path: Path, width: int) -> None:
        """Open the file, or begin it.

        Args:
            path: the file; its folder is made.
            width: dimensions of a vector.

        Raises:
            DataError: it cannot be written.
        """
        self._row_type = np.dtype([("key", "S32"), ("vector", "<f4", (width,))])
        self._rows: dict[str, int] = {}
        self._n_rows = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a+b")
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error.strerror}); set XDG_CACHE_HOME") from error
        self._look()

    def __contains__(self, key: str) -> bool:
        return key in self._rows

    def add(self, keys: Sequence[str], vectors: np.ndarray) -> None:
        """Keep vectors.

        Args:
            keys: 32 ASCII characters each; of a key that another process has added meanwhile its vector stays.
            vectors: (keys, width).

        Raises:
            DataError: there is no room.
        """
        rows = np.zeros(len(keys), self._row_type)
        rows["key"], rows["vector"] = keys, vectors
        fcntl.flock(self._file, fcntl.LOCK_EX)
        try:
            size = os.fstat(self._file.fileno()).st_size
            self._file.truncate(size - size % self._row_type.itemsize)  # what a killed process left unfinished
            self._file.write(rows.tobytes())
            self._file.flush()
        except OSError as error:
            raise DataError(f"{self._file.name}: cannot be written ({error.strerror}); make room") from error
        finally:
            fcntl.flock(self._file, fcntl.LOCK_UN)
        self._look()

    def get(self, keys: Sequence[str]) -> np.ndarray:
        """The vectors of known keys, (keys, width)."""
        return np.asarray(self._mapped()["vector"][[self._rows[key] for key in keys]])

    def _look(self) -> None:
        """Learn the keys of rows that are new, whoever added them."""
        rows = self._mapped()
        for row, key in enumerate(rows["key"][self._n_rows :].tolist(), self._n_rows):
            self._rows.setdefault(key.decode(), row)
        self._n_rows = len(rows)

    def _mapped(self) -> np.ndarray:
        n_rows = os.fstat(self._file.fileno()).st_size // self._row_type.itemsize
        if not n_rows:  # nothing cannot be mapped
            return np.zeros(0, self._row_type)
        return np.memmap(self._file, self._row_type, mode="r", shape=(n_rows,))


def nearest(vectors: np.ndarray, wanted: np.ndarray, top_k: int) -> tuple[int, ...]:
    """Rows with the largest cosine, ascending.

    Args:
        vectors: (rows, dimensions), of length 1.
        wanted: (dimensions,), of length 1.
        top_k: how many.
    """
    similarity = np.round(vectors.astype(np.float64) @ wanted.astype(np.float64), _DIGITS)
    order = np.argsort(-similarity, kind="stable")
    return tuple(sorted(order[:top_k].tolist()))
