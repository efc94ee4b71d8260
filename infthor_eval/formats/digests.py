"""The one way in which content, files and values are hashed."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

__all__ = ["SIZE", "canonical_json", "digest", "digest_of_file", "digest_of_files", "fingerprint", "seed_of"]

SIZE = 16  # bytes of a digest of content; names and fingerprints take fewer


def digest(content: bytes | str, size: int = SIZE) -> str:
    """BLAKE2b of some content (hex, two characters per byte of `size`)."""
    data = content.encode() if isinstance(content, str) else content
    return hashlib.blake2b(data, digest_size=size).hexdigest()


def digest_of_file(path: Path) -> str:
    """BLAKE2b of a file's content (hex, 32 characters), read in pieces.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=SIZE)).hexdigest()


def digest_of_files(paths: Iterable[Path]) -> str:
    """BLAKE2b of several files' names and contents, in the order given (hex, 32 characters).

    Raises:
        OSError: one of them cannot be read.
    """
    whole = hashlib.blake2b(digest_size=SIZE)
    for path in paths:
        whole.update(f"{path.name}\n{digest_of_file(path)}\n".encode())
    return whole.hexdigest()


def seed_of(text: str) -> int:
    """A seed that depends on the text alone, the same in every process (64 bits)."""
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest())


def canonical_json(value: object) -> str:
    """One text for one value: sorted keys, no spaces. Values must be JSON's own."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def fingerprint(value: Mapping[str, Any]) -> str:
    """Hash of a mapping of JSON values (hex, 16 characters)."""
    return digest(canonical_json(value), 8)
