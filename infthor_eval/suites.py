"""The suites and their presenters, by the names that task files use.

A suite, its options for the command line and its presenter are imported only when needed, so that `--help` stays quick.
Other packages add theirs through the entry point groups `infthor_eval.suites` and `infthor_eval.presenters`, as
"module:Class" under the suite's name. A suite of another package without a presenter gets `PlainPresenter`.
"""

import importlib
from collections.abc import Iterable, Mapping
from functools import reduce
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, NamedTuple

from infthor_eval.errors import UsageError, unknown_name, wrap_errors

if TYPE_CHECKING:
    from infthor_eval.report.presenter import Presenter
    from infthor_eval.runs import Suite, TaskFile

__all__ = [
    "ENTRY_POINTS",
    "PRESENTERS",
    "baseline_names",
    "options_of",
    "presenter_of",
    "split_by_suite",
    "suite_identity",
    "suite_named",
    "suite_names",
]

ENTRY_POINTS, PRESENTERS = "infthor_eval.suites", "infthor_eval.presenters"
_PLAIN = "infthor_eval.report.plain:PlainPresenter"


class _Target(NamedTuple):
    """Where a suite is found.

    Attributes:
        suite: "module:Class" of the suite.
        options: "module:Class" of its options.
        presenter: "module:Class" of its presenter.
        baselines: names of its `baselines`, which can be listed without importing them; None asks the suite.
    """

    suite: str
    options: str
    presenter: str
    baselines: tuple[str, ...] | None = None


_BUILT_IN = {
    "nieh": _Target(
        "infthor_eval.nieh.suite:NiehSuite",
        "infthor_eval.nieh.options:NiehOptions",
        "infthor_eval.report.suites.nieh:NiehPresenter",
        ("oracle", "blind", "blind-count", "random"),
    ),
    "manipulation": _Target(
        "infthor_eval.manipulation.suite:ManipulationSuite",
        "infthor_eval.manipulation.options:ManipulationOptions",
        "infthor_eval.report.suites.manipulation:ManipulationPresenter",
        ("planner-arm", "random-arm", "still"),
    ),
    "plans": _Target(
        "infthor_eval.plans.suite:PlansSuite",
        "infthor_eval.plans.options:PlansOptions",
        "infthor_eval.report.suites.plans:PlansPresenter",
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
    from infthor_eval.runs import Suite

    suite_class = _import(name, _target(name).suite)
    if name not in _BUILT_IN:
        _require_members(name, suite_class, Suite)
        if suite_class.name != name:
            raise UsageError(f"the suite {name} of another package calls itself {suite_class.name!r}; give it one name")
    suite: Suite = suite_class()
    return suite


def presenter_of(name: str) -> "Presenter":
    """Return the presenter of a suite.

    Raises:
        UsageError: that of another package cannot be imported or lacks a member of `Presenter`.
    """
    from infthor_eval.report.presenter import Presenter

    presenter_class = _import(name, _target(name).presenter)
    if name not in _BUILT_IN:
        _require_members(name, presenter_class, Presenter)
    presenter: Presenter = presenter_class()
    return presenter


def options_of(name: str) -> type:
    """The dataclass of a suite's options.

    Raises:
        UsageError: the suite of another package cannot be imported.
    """
    options: type = _import(name, _target(name).options)
    return options


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


def _entry_points(group: str = ENTRY_POINTS) -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=group)}


def _target(name: str) -> _Target:
    # Entry points are read only for suites of other packages: reading them takes time.
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    suite, presenter = _entry_points()[name].value, _entry_points(PRESENTERS).get(name)
    return _Target(suite, f"{suite}.options", _PLAIN if presenter is None else presenter.value)


def _import(name: str, target: str) -> Any:
    module, _, attributes = target.partition(":")
    problem = f"the suite {name} cannot be imported from {target}"
    with wrap_errors(
        problem, "fix its package, or uninstall it", catch=(ImportError, AttributeError), raise_as=UsageError
    ):
        return reduce(getattr, attributes.split("."), importlib.import_module(module))


def _require_members(name: str, given: Any, protocol: Any) -> None:
    """Check a class of another package.

    Raises:
        UsageError: the class lacks members of the protocol.
    """
    members = [*protocol.__annotations__, *(member for member in vars(protocol) if not member.startswith("_"))]
    missing = [member for member in members if not hasattr(given, member)]
    if missing:
        what = protocol.__name__.lower()
        raise UsageError(f"the {what} {name} of another package lacks {', '.join(missing)}; see docs/own-tasks.md")
