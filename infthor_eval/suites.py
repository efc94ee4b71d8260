"""The suites that there are, by the names that task files use.

A suite, and its options for the command line, are imported only when asked for, so that `--help` stays quick.
"""

import importlib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from infthor_eval.errors import unknown_name

if TYPE_CHECKING:
    from infthor_eval.runs import Suite, TaskFile

__all__ = ["baseline_names", "options_of", "split_by_suite", "suite_named", "suite_names"]


class _Entry(NamedTuple):
    """Where a suite is found.

    Attributes:
        suite: "module:Class" of it.
        options: "module:Class" of its options.
        baselines: names of its `baselines`, which can be listed without importing them.
    """

    suite: str
    options: str
    baselines: tuple[str, ...]


_SUITES = {
    "nieh": _Entry(
        "infthor_eval.nieh.suite:NiehSuite",
        "infthor_eval.nieh.options:NiehOptions",
        ("oracle", "blind", "blind-count", "random"),
    ),
    "manipulation": _Entry(
        "infthor_eval.manipulation.suite:ManipulationSuite",
        "infthor_eval.manipulation.options:ManipulationOptions",
        ("planner-arm", "random-arm", "still"),
    ),
    "plans": _Entry(
        "infthor_eval.agents.suite:PlansSuite",
        "infthor_eval.agents.options:PlansOptions",
        ("planner", "random", "scripted", "history"),
    ),
}


def suite_names() -> tuple[str, ...]:
    """All suites."""
    return tuple(_SUITES)


def suite_named(name: str) -> "Suite":
    """The suite of that name.

    Raises:
        UsageError: there is none.
    """
    if name not in _SUITES:
        raise unknown_name("suite", name, _SUITES)
    made: Suite = _imported(_SUITES[name].suite)()
    return made


def options_of(name: str) -> type:
    """The dataclass of a suite's options."""
    found: type = _imported(_SUITES[name].options)
    return found


def baseline_names() -> dict[str, str]:
    """The baselines of all suites, each with the suites that have it, in words."""
    found: dict[str, list[str]] = {}
    for name, entry in _SUITES.items():
        for baseline in entry.baselines:
            found.setdefault(baseline, []).append(name)
    return {baseline: ", ".join(names) for baseline, names in found.items()}


def split_by_suite(tasks: Iterable["TaskFile"]) -> Mapping[str, list["TaskFile"]]:
    """Tasks by their suite, in the order given; a run is of one suite."""
    found: dict[str, list[TaskFile]] = {}
    for task in tasks:
        found.setdefault(task.suite, []).append(task)
    return found


def _imported(target: str) -> Any:
    module, _, attribute = target.partition(":")
    return getattr(importlib.import_module(module), attribute)
