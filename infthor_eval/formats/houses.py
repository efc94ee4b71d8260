"""Houses of ProcTHOR, as files from which trajectories are generated."""

from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.reading import read_json
from infthor_eval.storage.digests import canonical_json, digest

__all__ = ["read_house"]

_PARTS = ("rooms", "walls", "objects")
_HINT = "give the JSON of one house, as ProcTHOR generates it"


def read_house(path: Path) -> tuple[str, dict[str, Any]]:
    """Return a house's name as a scene, by its content, and its JSON.

    Raises:
        DataError: the file cannot be read, or is no house.
    """
    house = read_json(path, _HINT)
    if not isinstance(house, dict) or not all(isinstance(house.get(part), list) for part in _PARTS):
        raise DataError(f"{path}: has not the lists {', '.join(_PARTS)} of a house; {_HINT}")
    return f"procthor-{digest(canonical_json(house), 5)}", house
