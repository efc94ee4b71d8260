"""Files of runs and of published logs."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["edit_json", "find_one", "read_json_lines"]


def find_one(folder: Path, pattern: str) -> Path:
    """The one path below a folder that matches."""
    (path,) = folder.rglob(pattern)
    return path


def read_json_lines(path: Path) -> list[Any]:
    """The rows of a compressed file of JSON lines."""
    with gzip.open(path) as lines:
        return [json.loads(line) for line in lines]


def edit_json(name: str, **changes: Any) -> Callable[[Path], None]:
    """What changes top-level settings of a file of that name in a folder."""

    def edit(folder: Path) -> None:
        path = folder / name
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return edit
