"""Two sets of files, compared: JSON by its keys, other texts by their lines."""

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any

_SHOWN = 12  # differences of one file
_WIDTH = 90  # letters of a value
_LABELS = ("type", "task", "id", "variant", "repeat", "question_id", "sample_id", "doc_id")
_NOTHING = object()


def compare(old: Mapping[str, bytes], new: Mapping[str, bytes]) -> Iterator[tuple[str, str]]:
    """Yield each difference: the file, and what differs there. A case that one of them does not
    have is one difference."""
    cases = [{name.partition("/")[0] for name in files} for files in (old, new)]
    for case in sorted(cases[0] ^ cases[1]):
        yield case, "is gone" if case in cases[0] else "is new"
    for name in sorted(old.keys() | new.keys()):
        if name.partition("/")[0] not in cases[0] & cases[1]:
            continue
        if name not in new or name not in old:
            yield name, "is gone" if name in old else "is new"
        elif old[name] != new[name] and not _is_journal_in_another_order(name, old, new):
            values = [_parse(name, files[name].decode()) for files in (old, new)]
            found = list(_differ("", *values))
            for difference in found or ["is written otherwise: order, spaces or line ends"]:
                yield name, difference


def read_named(path: Path) -> dict[str, str]:
    """Return the reasons by the patterns of a file of named differences; none if it is not there.

    Raises:
        ValueError: a line has no reason.
    """
    named = {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else ()
    for line in filter(str.strip, lines):
        pattern, _, reason = map(str.strip, line.rpartition("  # "))
        if not (pattern and reason):
            raise ValueError(f"{path}: {line!r} is not PATTERN, two spaces, # REASON")
        named[pattern] = reason
    return named


def print_differences(differences: Iterable[tuple[str, str]], named: Mapping[str, str]) -> int:
    """Print the differences that have no name, and how many have one; returns the exit code."""
    excused: Counter[str] = Counter()
    unnamed: Counter[str] = Counter()
    for file, difference in differences:
        line = f"{file}: {difference}"
        if name := next((pattern for pattern in named if re.search(pattern, line)), None):
            excused[name] += 1
            continue
        unnamed[file] += 1
        if unnamed[file] <= _SHOWN:
            print(line)
    for file, n in unnamed.items():
        if n > _SHOWN:
            print(f"{file}: and {n - _SHOWN:,} more")
    for pattern, reason in named.items():
        print(f"named, {excused[pattern]:,}: {pattern} ({reason})")
    total = f"{unnamed.total():,} differences without a name, in {len(unnamed):,} files"
    print(f"{total}; {excused.total():,} with one")
    return int(bool(unnamed))


def _is_journal_in_another_order(
    name: str, old: Mapping[str, bytes], new: Mapping[str, bytes]
) -> bool:
    """Of units that are in flight at once, another one may end first."""
    lines = [sorted(files[name].splitlines()) for files in (old, new)]
    return "/journal/" in name and lines[0] == lines[1]


def _parse(name: str, text: str) -> Any:
    if name.endswith(".jsonl"):
        return [json.loads(line) for line in text.splitlines()]
    return json.loads(text) if name.endswith(".json") else text


def _differ(where: str, old: Any, new: Any) -> Iterator[str]:
    if isinstance(old, list) and isinstance(new, list):
        old, new = _by_label(old), _by_label(new)
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old | new:
            below = f"{where}/{key}" if where else str(key)
            yield from _differ(below, old.get(key, _NOTHING), new.get(key, _NOTHING))
    elif not where and isinstance(old, str) and isinstance(new, str):
        yield from _differ_in_lines(old.splitlines(), new.splitlines())
    elif (texts := (_write(old), _write(new)))[0] != texts[1]:
        yield f"{where}: {_shorten(*texts)}"


def _by_label(values: list[Any]) -> dict[Any, Any]:
    """The values of a list by what they are called, or by their places."""
    if all(isinstance(value, dict) for value in values):
        labels = ["|".join(str(it[name]) for name in _LABELS if name in it) for it in values]
        if all(labels) and len(set(labels)) == len(labels):
            return dict(zip(labels, values, strict=True))
    return dict(enumerate(values))


def _differ_in_lines(old: list[str], new: list[str]) -> Iterator[str]:
    for tag, start, end, new_start, new_end in SequenceMatcher(None, old, new).get_opcodes():
        if tag != "equal":
            pairs = zip_longest(old[start:end], new[new_start:new_end], fillvalue="nothing")
            for number, pair in enumerate(pairs, start + 1):
                yield f"line {number}: {_shorten(*pair)}"


def _write(value: Any) -> str:
    return "nothing" if value is _NOTHING else json.dumps(value, ensure_ascii=False)


def _shorten(old: str, new: str) -> str:
    """Both texts, from shortly before they differ."""
    pairs = enumerate(zip(old, new, strict=False))
    at = max(0, next((n for n, (one, two) in pairs if one != two), len(min(old, new))) - 20)
    cut = [f"{'…' * (at > 0)}{text[at : at + _WIDTH]}" for text in (old, new)]
    return f"{cut[0]} -> {cut[1]}"
