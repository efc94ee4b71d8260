"""Reasons for people: those that differ in their numbers alone are one."""

import re
from collections import defaultdict
from collections.abc import Iterable
from typing import TypeVar

__all__ = ["count_reasons"]

_Where = TypeVar("_Where", str, tuple[str, str])  # a task, or a task and what became of its units

# A number that stands alone: those in paths, names and ids tell things apart.
_NUMBER = re.compile(r"(?<![\w/.,-])\d+(?:,\d{3})*(?:\.\d+)?(?![\w/]|[.,-]\w)")


def count_reasons(reasons: Iterable[tuple[_Where, str]]) -> list[tuple[_Where, str, int]]:
    """Task, reason and how often, in the order of the alphabet; numbers that differ are told as a range.

    Args:
        reasons: task (or task and what became of it) and reason of each case.
    """
    alike: dict[tuple[_Where, str], list[str]] = defaultdict(list)
    for where, reason in reasons:
        alike[where, _NUMBER.sub("#", reason)].append(reason)
    return [(where, _in_ranges(found), len(found)) for (where, _), found in sorted(alike.items())]


def _in_ranges(reasons: list[str]) -> str:
    """One reason for all: they differ in their numbers alone."""
    columns = zip(*(_NUMBER.findall(reason) for reason in reasons), strict=True)
    ranges = iter([_range(column) for column in columns])
    return _NUMBER.sub(lambda _: next(ranges), reasons[0])


def _range(numbers: tuple[str, ...]) -> str:
    least, most = (choose(numbers, key=lambda text: float(text.replace(",", ""))) for choose in (min, max))
    return least if least == most else f"{least} to {most}"
