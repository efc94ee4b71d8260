"""The card of a checkpoint (README.md), as far as it says how the checkpoint was trained.

Our training writes `infthor_words: published` into the card's metadata, the YAML between two lines
of dashes at its beginning: the words of plans and actions that the checkpoint was trained on.
"""

from pathlib import Path

import yaml

WORDS = "infthor_words"
_DASHES = "---"
_MOST_BYTES = 1_000_000  # of a card


def read_card_words(folder: Path) -> str | None:
    """Return the words that a checkpoint was trained on; None if no card says so."""
    path = folder / "README.md"
    if not path.is_file() or path.stat().st_size > _MOST_BYTES:
        return None
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    if lines[:1] != [_DASHES] or _DASHES not in lines[1:]:
        return None
    try:
        metadata = yaml.safe_load("\n".join(lines[1 : lines.index(_DASHES, 1)]))
    except (yaml.YAMLError, RecursionError, ValueError, TypeError):
        # The last two: of dates and keys that are none. A card of somebody else need not be ours to
        # read.
        return None
    words = metadata.get(WORDS) if isinstance(metadata, dict) else None
    return words if isinstance(words, str) else None
