"""Reasons for people: those that differ in their numbers alone are one."""

import re
from collections import defaultdict
from collections.abc import Iterable

__all__ = ["counted_reasons"]

# A number that stands alone: those in paths, names and ids tell things apart.
_NUMBER = re.compile(r"(?<![\w/.,-])\d+(?:,\d{3})*(?:\.\d+)?(?![\w/]|[.,-]\w)")


def counted_reasons(reasons: Iterable[tuple[str, str]]) -> list[tuple[str, str, int]]:
    """Task, reason and how often, in the order of the alphabet; numbers that differ are told as a range.

    Args:
        reasons: task and reason of each case.
    """
    alike: dict[tuple[str, str], list[str]] = defaultdict(list)
    for task, reason in reasons:
        alike[task, _NUMBER.sub("#", reason)].append(reason)
    return [(task, _in_ranges(found), len(found)) for (task, _), found in sorted(alike.items())]


def _in_ranges(reasons: list[str]) -> str:
    """One reason for all: they differ in their numbers alone."""
    columns = zip(*(_NUMBER.findall(reason) for reason in reasons), strict=True)
    ranges = iter([_range(column) for column in columns])
    return _NUMBER.sub(lambda _: next(ranges), reasons[0])


def _range(numbers: tuple[str, ...]) -> str:
    least, most = (choose(numbers, key=lambda text: float(text.replace(",", ""))) for choose in (min, max))
    return least if least == most else f"{least} to {most}"
