"""Counting reasons for people; reasons that differ only in their numbers are counted as one."""

import re
from collections import defaultdict
from collections.abc import Iterable
from typing import TypeVar

_Where = TypeVar("_Where", str, tuple[str, str])  # a task, or a task and the outcome of its units

# A number that is a word of its own. Numbers in paths, names and ids are not merged: they tell
# things apart.
_NUMBER = re.compile(r"(?<![\w/.,-])\d+(?:,\d{3})*(?:\.\d+)?(?![\w/]|[.,-]\w)")


def count_reasons(reasons: Iterable[tuple[_Where, str]]) -> list[tuple[_Where, str, int]]:
    """Count reasons by task (or task and outcome), sorted; numbers that differ become a range."""
    groups: dict[tuple[_Where, str], list[str]] = defaultdict(list)
    for where, reason in reasons:
        groups[where, _NUMBER.sub("#", reason)].append(reason)
    return [(where, _merge(group), len(group)) for (where, _), group in sorted(groups.items())]


def _merge(reasons: list[str]) -> str:
    """Return one text for reasons that differ only in their numbers."""
    columns = zip(*(_NUMBER.findall(reason) for reason in reasons), strict=True)
    ranges = iter([_range(column) for column in columns])
    return _NUMBER.sub(lambda _: next(ranges), reasons[0])


def _range(numbers: tuple[str, ...]) -> str:
    least = min(numbers, key=_value)
    most = max(numbers, key=_value)
    return least if least == most else f"{least} to {most}"


def _value(number: str) -> float:
    return float(number.replace(",", ""))
