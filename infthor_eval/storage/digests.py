"""Hashes of content, files and values, all BLAKE2b."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

__all__ = [
    "SIZE",
    "canonical_json",
    "digest",
    "digest_of_file",
    "digest_of_files",
    "fingerprint",
    "json_values",
    "seed_of",
]

SIZE = 16  # bytes of a content digest; names and fingerprints are shorter


def digest(content: bytes | str, size: int = SIZE) -> str:
    """Return the hash of some content (hex, two characters per byte of `size`)."""
    data = content.encode() if isinstance(content, str) else content
    return hashlib.blake2b(data, digest_size=size).hexdigest()


def digest_of_file(path: Path) -> str:
    """Return the hash of a file's content (hex, 32 characters); the file is read in pieces.

    Raises:
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=SIZE)).hexdigest()


def digest_of_files(paths: Iterable[Path]) -> str:
    """Return the hash of names and contents of files, in the order given (hex, 32 characters).

    Raises:
        OSError: a file cannot be read.
    """
    whole = hashlib.blake2b(digest_size=SIZE)
    for path in paths:
        whole.update(f"{path.name}\n{digest_of_file(path)}\n".encode())
    return whole.hexdigest()


def seed_of(text: str) -> int:
    """Return a seed that depends only on the text (64 bits)."""
    # Not `hash`, which Python salts anew in every process.
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest())


def canonical_json(value: object) -> str:
    """Return the one JSON text of a value: keys sorted, no spaces, no NaN."""
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )


def json_values(value: object) -> Any:
    """Return a value as it is read back from JSON: tuples become lists, keys strings."""
    return json.loads(json.dumps(value))


def fingerprint(value: Mapping[str, Any]) -> str:
    """Return the hash of a mapping of JSON values (hex, 16 characters)."""
    return digest(canonical_json(value), 8)
