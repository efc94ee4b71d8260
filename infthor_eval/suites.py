"""The suites that there are, by the names that task files use.

A suite, and its options for the command line, are imported only when asked for, so that `--help` stays quick. Packages
add their own through the entry point group `infthor_eval.suites`, as "module:Class" under the suite's name.
"""

import importlib
from collections.abc import Iterable, Mapping
from functools import reduce
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, NamedTuple

from infthor_eval.errors import UsageError, unknown_name, wrap_errors

if TYPE_CHECKING:
    from infthor_eval.runs import Suite, TaskFile

__all__ = [
    "ENTRY_POINTS",
    "baseline_names",
    "options_of",
    "split_by_suite",
    "suite_identity",
    "suite_named",
    "suite_names",
]

ENTRY_POINTS = "infthor_eval.suites"


class _Target(NamedTuple):
    """Where a suite is found.

    Attributes:
        suite: "module:Class" of it.
        options: "module:Class" of its options.
        baselines: names of its `baselines`, which can be listed without importing them; None asks the suite.
    """

    suite: str
    options: str
    baselines: tuple[str, ...] | None = None


_BUILT_IN = {
    "nieh": _Target(
        "infthor_eval.nieh.suite:NiehSuite",
        "infthor_eval.nieh.options:NiehOptions",
        ("oracle", "blind", "blind-count", "random"),
    ),
    "manipulation": _Target(
        "infthor_eval.manipulation.suite:ManipulationSuite",
        "infthor_eval.manipulation.options:ManipulationOptions",
        ("planner-arm", "random-arm", "still"),
    ),
    "plans": _Target(
        "infthor_eval.plans.suite:PlansSuite",
        "infthor_eval.plans.options:PlansOptions",
        ("planner", "random", "scripted", "history"),
    ),
}


def suite_names() -> tuple[str, ...]:
    """All suites, the built-in ones first."""
    # Built-in names win: a package cannot change what a known name means.
    return tuple(dict.fromkeys([*_BUILT_IN, *_entry_points()]))


def suite_named(name: str) -> "Suite":
    """The suite of that name.

    Raises:
        UsageError: there is none, or that of another package is not what a suite must be.
    """
    if name not in suite_names():
        raise unknown_name("suite", name, suite_names())
    found = _imported(name, _target(name).suite)
    if name not in _BUILT_IN:
        _check(name, found)
    made: Suite = found()
    return made


def options_of(name: str) -> type:
    """The dataclass of a suite's options.

    Raises:
        UsageError: the suite of another package cannot be imported.
    """
    found: type = _imported(name, _target(name).options)
    return found


def suite_identity(name: str) -> dict[str, Any]:
    """What distinguishes a suite's code from other versions of it, as JSON values; nothing for a built-in one.

    Raises:
        ModelError: its source cannot be read.
    """
    from model_adapters.adapter_identity import package_identity

    return {} if name in _BUILT_IN else package_identity(_entry_points()[name])


def baseline_names() -> dict[str, str]:
    """The baselines of all suites, each with the suites that have it, in words."""
    found: dict[str, list[str]] = {}
    for name in suite_names():
        told = _target(name).baselines
        for baseline in suite_named(name).baselines if told is None else told:
            found.setdefault(baseline, []).append(name)
    return {baseline: ", ".join(names) for baseline, names in found.items()}


def split_by_suite(tasks: Iterable["TaskFile"]) -> Mapping[str, list["TaskFile"]]:
    """Tasks by their suite, in the order given; a run is of one suite."""
    found: dict[str, list[TaskFile]] = {}
    for task in tasks:
        found.setdefault(task.suite, []).append(task)
    return found


def _entry_points() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=ENTRY_POINTS)}


def _target(name: str) -> _Target:
    """Where a suite is found; other packages are looked at for theirs alone, as that takes time."""
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    value = _entry_points()[name].value
    return _Target(value, f"{value}.options")


def _imported(name: str, target: str) -> Any:
    module, _, attributes = target.partition(":")
    problem = f"the suite {name} cannot be imported from {target}"
    with wrap_errors(
        problem, "mend its package, or uninstall it", catch=(ImportError, AttributeError), raise_as=UsageError
    ):
        return reduce(getattr, attributes.split("."), importlib.import_module(module))


def _check(name: str, found: Any) -> None:
    """Refuse a class of another package that lacks what a suite has.

    Raises:
        UsageError: names what it lacks.
    """
    from infthor_eval.runs import Suite

    members = [*Suite.__annotations__, *(member for member in vars(Suite) if not member.startswith("_"))]
    missing = [member for member in members if not hasattr(found, member)]
    if missing:
        raise UsageError(f"the suite {name} of another package lacks {', '.join(missing)}; see docs/own-tasks.md")
    if found.name != name:
        raise UsageError(f"the suite {name} of another package calls itself {found.name!r}; give it one name")
