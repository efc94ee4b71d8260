"""`set.json` of an NIEH set: the format of its files, and which simulator rendered its frames."""

import json
from pathlib import Path
from typing import Any

import infthor_eval
from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import read_json
from infthor_eval.storage.files import is_written, write_atomically, writing_hint

FORMAT = 1  # increased when the files of a set that we write change their meaning
_FILE = "set.json"


def simulator_of(root: Path) -> str | None:
    """Return what rendered the set's frames ("embedded", "unity"), or None if it is not recorded.

    Published sets do not record it.
    """
    simulator = _recorded(root, "simulator")
    if simulator is not None and not isinstance(simulator, str):
        raise DataError(
            f"{root / _FILE}: simulator is {simulator!r:.40}, not a name; write the set again"
        )
    return simulator


def frames_of(root: Path) -> int | None:
    """Return the version of the embedded simulator's drawing that a set's frames are of, or None.

    Sets of the first version do not record it.
    """
    frames = _recorded(root, "frames")
    if frames is not None and not isinstance(frames, int):
        raise DataError(
            f"{root / _FILE}: frames is {frames!r:.40}, not a number; write the set again"
        )
    return frames


def writer_of(root: Path) -> str | None:
    """Return the version of infthor-eval that wrote a set, or None if it is not recorded."""
    version = _recorded(root, "infthor_eval")
    return None if version is None else str(version)


def claim_for_simulator(root: Path, simulator: str, frames: int | None = None) -> None:
    """Record what renders the frames of a set that is about to be written or continued.

    Args:
        root: folder of the set.
        simulator: "embedded" or "unity".
        frames: version of the embedded simulator's drawing.
    """
    path = root / _FILE
    version = infthor_eval.__version__
    if not is_written(path):
        info: dict[str, Any] = {"format": FORMAT, "simulator": simulator, "infthor_eval": version}
        if frames is not None:
            info["frames"] = frames
        with (
            wrap_errors(f"{path}: cannot be written", writing_hint(", or give another folder")),
            write_atomically(path) as partial,
        ):
            partial.write_text(json.dumps(info) + "\n", encoding="utf-8")
        return
    info = _read(path)
    theirs = info.get("simulator")
    wrote = info.get("infthor_eval")
    if theirs != simulator:
        raise DataError(
            f"{root}: its frames are of the {theirs} simulator; give another folder for the "
            f"{simulator} one"
        )
    drawing = frames_of(root)
    if drawing != frames:
        raise DataError(
            f"{root}: its frames are version {drawing or 1} of the drawing, this is "
            f"{frames}; give another folder"
        )
    if wrote != version:
        raise DataError(
            f"{root}: its frames were rendered by version {wrote}, this is {version}; give another "
            "folder"
        )


def _recorded(root: Path, name: str) -> Any:
    path = root / _FILE
    return _read(path).get(name) if path.exists() else None


def _read(path: Path) -> dict[str, Any]:
    info = read_json(path, "write the set again")
    if not isinstance(info, dict):
        raise DataError(f"{path}: not a JSON object; write the set again")
    if info.get("format", FORMAT) != FORMAT:
        raise DataError(
            f"{path}: the set has format {info['format']}, this version reads {FORMAT}; use the "
            "version that wrote it, or create the set again"
        )
    return info
