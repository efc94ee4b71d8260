"""What a run left in a folder, without what differs from run to run: times, and what they name."""

import json
import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

__all__ = ["difference", "read_tree"]

Tree = dict[str, Any]

# lm-eval puts the time of writing into its names.
_STAMP = re.compile(r"_\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d\.\d+(?=\.jsonl?$)")
_SCRATCH = re.compile(r"(\.infthor-)\w{8}(?=[./]|$)")  # a temporary folder, and its lock
# Of a unit's record: its time, how often it was tried, what it survived, what was cached.
_OF_A_TRY = ("seconds", "attempt", "faults", "cached")
# Of an export for others: its time, a name that is made of it, hashes of files that have either.
_OF_AN_EXPORT = ("date", "evaluation_id", "retrieved_timestamp", "checksum")


def read_tree(folder: Path) -> Tree:
    """Return the content of each file by its name, in the form in which equal runs are equal."""
    tree: Tree = {}
    for path in sorted(folder.rglob("*")):
        name = _STAMP.sub("_TIME", path.relative_to(folder).as_posix())
        name = _SCRATCH.sub(r"\1NAME", name)
        tree.setdefault(name, "folder" if path.is_dir() else _content(path))
        if not path.is_dir() and tree[name] != _content(path):  # two of one name but for the time
            tree[f"{name} again"] = _content(path)
    return tree


def difference(expected: Tree, found: Tree) -> str | None:
    """Return the first difference in words; None if there is none."""
    for name in sorted({*expected, *found}):
        if name not in found:
            return f"{name} is missing"
        if name not in expected:
            return f"{name} is too many"
        if expected[name] != found[name]:
            return f"{name} differs"
    return None


def _content(path: Path) -> Any:
    content = path.read_bytes()
    reader = next((read for fits, read in _READERS if fits(path)), None)
    if reader is None:
        return content
    try:
        return reader(content)
    except ValueError:
        return content


def _journal(content: bytes) -> Any:
    """The last record of each unit, and all others."""
    lines = [json.loads(line) for line in content.splitlines()]
    records = [_without(line, _OF_A_TRY) for line in lines]
    last = {
        json.dumps(
            [record.get(key) for key in ("type", "task", "id", "variant", "repeat", "fingerprint")]
        ): record
        for record in records
    }
    return dict(sorted(last.items())), content.endswith(b"\n")


def _without(value: Any, names: tuple[str, ...]) -> Any:
    if isinstance(value, dict):
        return {key: _without(item, names) for key, item in value.items() if key not in names}
    return [_without(item, names) for item in value] if isinstance(value, list) else value


def _without_times(*names: str) -> Callable[[bytes], Any]:
    return lambda content: _without(json.loads(content), names)


def _lines(content: bytes) -> Any:
    """Lines of JSON, without the export that they belong to."""
    return [_without(json.loads(line), _OF_AN_EXPORT) for line in content.splitlines()]


def _archive(content: bytes) -> Any:
    """What is in a zip file, without when it was put there."""
    with ZipFile(BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


_READERS: tuple[tuple[Callable[[Path], bool], Callable[[bytes], Any]], ...] = (
    (lambda path: path.parent.name == "journal" and path.suffix == ".jsonl", _journal),
    (lambda path: path.name == "usage.json", _without_times("seconds", "cached", "hit_rate")),
    (lambda path: path.name == "replay.json", _without_times("seconds")),
    (lambda path: path.parent.parent.name == "lm_eval", _without_times("date")),
    (
        lambda path: "exported" in path.parts and path.suffix == ".json",
        _without_times(*_OF_AN_EXPORT),
    ),
    (lambda path: "exported" in path.parts and path.suffix == ".jsonl", _lines),
    (lambda path: path.suffix == ".eval", _archive),
)
