"""The user's cache of downloaded data, video frames and frame vectors."""

import os
from pathlib import Path

__all__ = ["user_cache"]


def user_cache(name: str) -> Path:
    """Return the folder of this name in the user's cache (`$XDG_CACHE_HOME`, else `~/.cache`); it
    may not exist yet."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "infthor-eval" / name
