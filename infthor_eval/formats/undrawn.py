"""Bundled sets of twins that have the trajectories of their worlds in place of frames.

`worlds.jsonl.zst` has a trajectory a line, and `drawn.json` a digest of each world's frames and
log. The set with its frames is in the user's cache once they are drawn.
"""

from pathlib import Path

from infthor_eval.storage.digests import digest_of_file
from infthor_eval.storage.folders import user_cache

WORLDS = "worlds.jsonl.zst"
DIGESTS = "drawn.json"
SET_INFO = "set.json"


def is_undrawn(folder: Path) -> bool:
    """Return True for a set without frames of which these can be drawn."""
    return (folder / WORLDS).is_file()


def drawn_folder(folder: Path) -> Path:
    """Return the folder in the cache of an undrawn set with its frames, which may not exist yet."""
    return user_cache("sets") / f"{folder.name}-{digest_of_file(folder / WORLDS)[:12]}"


def is_drawn(folder: Path) -> bool:
    """Return True if all frames of an undrawn set are in the cache."""
    return (drawn_folder(folder) / SET_INFO).is_file()
