"""The suites that there are, by the names that task files use.

A suite, and its options for the command line, are imported only when asked for, so that `--help` stays quick.
"""

import importlib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from infthor_eval.errors import unknown_name

if TYPE_CHECKING:
    from infthor_eval.runs import Suite, TaskFile

__all__ = ["baseline_names", "options_of", "split_by_suite", "suite_named", "suite_names"]

# "module:Class" of the suite, and of its options.
_SUITES = {
    "nieh": ("infthor_eval.nieh.suite:NiehSuite", "infthor_eval.nieh.options:NiehOptions"),
    "manipulation": (
        "infthor_eval.manipulation.suite:ManipulationSuite",
        "infthor_eval.manipulation.options:ManipulationOptions",
    ),
    "plans": ("infthor_eval.agents.suite:PlansSuite", "infthor_eval.agents.options:PlansOptions"),
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
    made: Suite = _imported(_SUITES[name][0])()
    return made


def options_of(name: str) -> type:
    """The dataclass of a suite's options."""
    found: type = _imported(_SUITES[name][1])
    return found


def baseline_names() -> dict[str, str]:
    """The baselines of all suites, each with the suites that have it, in words."""
    found: dict[str, list[str]] = {}
    for name in _SUITES:
        for baseline in suite_named(name).baselines:
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
