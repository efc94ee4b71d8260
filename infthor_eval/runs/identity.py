"""A run's identity: the hash of everything that can change a number."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

__all__ = ["canonical_json", "fingerprint"]


def canonical_json(value: object) -> str:
    """One text for one value: sorted keys, no spaces. Values must be JSON's own."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def fingerprint(value: Mapping[str, Any]) -> str:
    """Hash of a mapping of JSON values (hex, 16 characters)."""
    return hashlib.blake2b(canonical_json(value).encode(), digest_size=8).hexdigest()
