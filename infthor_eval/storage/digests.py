"""Hashes of content, files and values, all BLAKE2b."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

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


def json_values(value: object, name: str = "it") -> Any:
    """Return a value as it is read back from JSON: tuples become lists.

    Args:
        value: a value that code of others gives.
        name: what it is, for messages.

    Raises:
        ValueError: something in it is none of JSON's values; the message names the field.
    """
    try:
        return _json_value(value, name)
    except RecursionError as error:
        raise ValueError(f"{name} is nested too deep, or in a circle") from error


def _json_value(value: Any, path: str) -> Any:
    # Of a class of its own, such as torch's version, as a plain one.
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return _plain_text(value, path)
    if isinstance(value, int):
        return int.__int__(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{path} is {value!r}, which JSON cannot hold")
        return float.__float__(value)
    if isinstance(value, list | tuple):
        return [_json_value(item, f"{path}[{index}]") for index, item in enumerate(value)]
    if isinstance(value, Mapping):
        items = {}
        for key, item in value.items():
            if not isinstance(key, str):
                raise ValueError(f"{path} has the key {key!r:.60}, which is no text")
            name = _plain_text(key, f"a key of {path}")
            items[name] = _json_value(item, f"{path}[{name!r:.60}]")
        return items
    raise ValueError(f"{path} is a {type(value).__name__}, which JSON cannot hold")


def _plain_text(text: str, path: str) -> str:
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"{path} is {text!r:.60}, which is no valid Unicode") from error
    return str.__str__(text)


def fingerprint(value: Mapping[str, Any]) -> str:
    """Return the hash of a mapping of JSON values (hex, 16 characters)."""
    return digest(canonical_json(value), 8)
