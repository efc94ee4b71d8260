"""Annotations of one's own in JSON, which `mapping.yaml` beside them describes, as rows of a CSV.

A line of the mapping has a column and the dotted path in an entry where it is, and one may say in
which list the entries are (the file itself, if none does):

    entries: data.queries
    question: text
    answer: reply
    trajectory: clip.uid
    clue_seconds: window
    moment_seconds: asked_at

Seconds are a number, [start, end], or a list of these.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.csv_files import CsvRow, shield
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.yaml_files import read_yaml

MAPPING = "mapping.yaml"
_ENTRIES = "entries"
_REQUIRED = ("question", "answer")
_COLUMNS = (*_REQUIRED, "trajectory", "clue_seconds", "moment_seconds")
_HINT = f"a line is `question: PATH`, likewise for {', '.join((_ENTRIES, *_COLUMNS[1:]))}"


def read_annotations(path: Path) -> Iterator[CsvRow]:
    """Yield the entries as rows, whose line is the number of the entry, from 1."""
    paths = _read_mapping(path.parent / MAPPING)
    entries = read_json(path, "write it again as JSON")
    where = paths.pop(_ENTRIES, None)
    if where is not None:
        try:
            entries = _find(entries, where)
        except DataError as error:
            raise DataError(f"{path}: {_ENTRIES}: {error}") from error
    if not isinstance(entries, list):
        raise DataError(
            f"{path}: {where or 'its top'} is no list; write `{_ENTRIES}: PATH` of one in {MAPPING}"
        )
    for number, entry in enumerate(entries, 1):
        cells = dict.fromkeys(_REQUIRED, "")
        problem = None
        for name, dotted in paths.items():
            try:
                cells[name] = shield(_cell(name, _find(entry, dotted)))
            except DataError as error:
                problem = problem or f"{name}: {error}"
        yield CsvRow(number, tuple(paths), cells, problem)


def _read_mapping(path: Path) -> dict[str, str]:
    paths = read_yaml(path, _HINT)
    if not isinstance(paths, dict):
        raise DataError(f"{path}: has no lines of names and paths; {_HINT}")
    for name, dotted in paths.items():
        if name not in (_ENTRIES, *_COLUMNS):
            raise DataError(f"{path}: {name!r:.40} is not known; {_HINT}")
        if not isinstance(dotted, str):
            raise DataError(f"{path}: {name} is no path, as in clip.uid; {_HINT}")
    missing = next((name for name in _REQUIRED if name not in paths), None)
    if missing is not None:
        raise DataError(f"{path}: does not say where {missing} is; {_HINT}")
    return paths


def _find(value: Any, dotted: str) -> Any:
    for name in dotted.split("."):
        if not isinstance(value, Mapping) or name not in value:
            raise DataError(f"there is no {dotted!r:.80}; add it, or correct the path in {MAPPING}")
        value = value[name]
    return value


def _cell(name: str, value: Any) -> str:
    """Return a value as a cell of a CSV file has it."""
    if name == "answer":  # a text is one answer, whatever is in it
        return json.dumps(value if isinstance(value, list) else [value])
    if name.endswith("_seconds"):
        is_range = isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
        spans = value if isinstance(value, list) and not is_range else [value]
        return ", ".join(map(_span, spans))
    if isinstance(value, str):
        return value
    if _is_number(value):
        return str(value)
    raise DataError("is no text; write one, or correct the path in " + MAPPING)


def _span(value: Any) -> str:
    ends = value if isinstance(value, list) and len(value) == 2 else [value]
    if not all(map(_is_number, ends)):
        raise DataError(
            f"{value!r:.40} is no number of seconds; write 12.5, [12, 14] or a list of these"
        )
    return "-".join(f"{end:.6f}" for end in ends)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
