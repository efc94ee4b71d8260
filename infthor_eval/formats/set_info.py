"""`set.json` of an NIEH set: what rendered its frames."""

import json
from pathlib import Path

from infthor_eval.errors import DataError

__all__ = ["claim_for_simulator", "simulator_of"]

_FILE = "set.json"


def simulator_of(root: Path) -> str | None:
    """What rendered the frames of the set ("embedded", "unity"); None where it does not say, as published sets.

    Raises:
        DataError: `set.json` is not a JSON object.
    """
    path = root / _FILE
    if not path.is_file():
        return None
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
        return str(info["simulator"]) if "simulator" in info else None
    except (ValueError, TypeError) as error:
        raise DataError(f"{path}: not a JSON object ({error}); write the set again") from error


def claim_for_simulator(root: Path, simulator: str) -> None:
    """Say what renders the frames of a set that is about to be written or continued.

    Raises:
        DataError: another simulator has rendered the frames that are there.
    """
    known = simulator_of(root)
    if known is None:
        (root / _FILE).write_text(json.dumps({"simulator": simulator}) + "\n", encoding="utf-8")
    elif known != simulator:
        raise DataError(f"{root}: its frames are of the {known} simulator; give another folder for the {simulator} one")
