"""The secret that a private set is drawn from."""

import hmac
import re
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.reading import read_text

__all__ = ["Secret", "read_secret"]

_HEX = re.compile(r"[0-9a-fA-F]{32,256}")
_SEED_BITS = 62
_HINT = "write one with `openssl rand -hex 32 > FILE`, and keep it secret"


@dataclass(frozen=True)
class Secret:
    """What all of a private set is drawn from."""

    _content: bytes

    def __repr__(self) -> str:
        return "Secret(...)"  # never in a traceback or a log

    def digest(self, what: str) -> str:
        """Return what nobody can compute without the secret (hex, 64 characters)."""
        return hmac.new(self._content, what.encode(), "sha256").hexdigest()

    def seed(self, what: str) -> int:
        """Return a seed for a purpose, from 0 to 2^62 - 1."""
        return int(self.digest(what), 16) >> (256 - _SEED_BITS)


def read_secret(path: Path) -> Secret:
    """Read a seed file: 32 to 256 hexadecimal digits in one line.

    Raises:
        DataError: it cannot be read, or is shorter: what can be tried out is no secret.
    """
    text = read_text(path, _HINT).strip()
    if not _HEX.fullmatch(text):
        raise DataError(
            f"{path}: not a secret of 32 to 256 hexadecimal digits in one line; {_HINT}"
        )
    return Secret(text.lower().encode())
