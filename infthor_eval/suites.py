"""The suites by the names in task files, with their presenters and lm-eval adapters.

Each class is imported only when needed, so that `--help` stays quick. Other packages add theirs
through entry points, as "module:Class" under the suite's name: the suite in `infthor_eval.suites`
(or a `QuestionSuite`, as "module:NAME"), its presenter in `infthor_eval.presenters` (without one it
gets `QuestionsPresenter` or `PlainPresenter`), its adapter in `infthor_eval.lm_eval`.

To add a suite: a package with a `Suite` (`infthor_eval/runs/suite.py`), its line here, task files
with `metadata: {suite: NAME}`, and a presenter in `infthor_eval/report/suites/`.

To add a suite of another package: entry points, of a `QuestionSuite` where it asks questions;
`examples/sums/` is a whole package to copy (`docs/own-tasks.md`).
"""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from infthor_eval.errors import UsageError
from infthor_eval.plugins import PluginTable, import_target

if TYPE_CHECKING:
    from infthor_eval.harness.requests import RequestAdapter
    from infthor_eval.manipulation.evaluation import ArmUnit
    from infthor_eval.manipulation.records import ArmRecord
    from infthor_eval.manipulation.suite import ManipulationSuite
    from infthor_eval.nieh.records import NiehAnswer
    from infthor_eval.nieh.suite import NiehSuite
    from infthor_eval.nieh.units import NiehUnit
    from infthor_eval.plans.evaluation import PlanUnit
    from infthor_eval.plans.records import PlanRecord
    from infthor_eval.plans.suite import PlansSuite
    from infthor_eval.report.plain import PlainPresenter
    from infthor_eval.runs import Suite, TaskFile

    # mypy holds the built-in suites to the protocol here: `find_suite`, which imports them by name,
    # cannot.
    _PROTOCOL: tuple[
        Suite[NiehUnit, NiehAnswer], Suite[ArmUnit, ArmRecord], Suite[PlanUnit, PlanRecord]
    ]
    _PROTOCOL = NiehSuite(), ManipulationSuite(), PlansSuite()


class _BuiltIn(NamedTuple):
    """A suite here: "module:Class" of its parts, and its baselines, listed without an import."""

    suite: str
    options: str
    presenter: str
    requests: str  # the adapter for lm-eval's requests
    baselines: tuple[str, ...]


_BUILT_IN = {
    "nieh": _BuiltIn(
        "infthor_eval.nieh.suite:NiehSuite",
        "infthor_eval.nieh.options:NiehOptions",
        "infthor_eval.report.suites.nieh:NiehPresenter",
        "infthor_eval.harness.nieh_task:NiehRequests",
        ("oracle", "blind", "random", "flip", "hash"),
    ),
    "manipulation": _BuiltIn(
        "infthor_eval.manipulation.suite:ManipulationSuite",
        "infthor_eval.manipulation.options:ManipulationOptions",
        "infthor_eval.report.suites.manipulation:ManipulationPresenter",
        "infthor_eval.harness.manipulation_task:ManipulationRequests",
        ("planner-arm", "random-arm", "still"),
    ),
    "plans": _BuiltIn(
        "infthor_eval.plans.suite:PlansSuite",
        "infthor_eval.plans.options:PlansOptions",
        "infthor_eval.report.suites.plans:PlansPresenter",
        "infthor_eval.harness.plans_task:PlansRequests",
        ("planner", "random", "scripted", "history", "recall"),
    ),
}


def _table_of(part: str, kind: str, group: str) -> PluginTable:
    """Return the table of one part of all suites; `kind` and `group` as in `PluginTable`."""
    built_in = {name: getattr(suite, part) for name, suite in _BUILT_IN.items()}
    return PluginTable(kind, group, built_in, "docs/own-tasks.md")


_SUITES = _table_of("suite", "suite", "infthor_eval.suites")
_PRESENTERS = _table_of("presenter", "presenter", "infthor_eval.presenters")
_REQUESTS = _table_of("requests", "lm-eval adapter of suite", "infthor_eval.lm_eval")


def suite_names() -> tuple[str, ...]:
    """Return the names of all suites, the built-in ones first."""
    return _SUITES.names


def find_suite(name: str) -> "Suite[Any, Any]":
    """Return the suite of a name."""
    from infthor_eval.runs import Suite

    suite = _SUITES.load(name, Suite)
    if suite.name != name:
        raise UsageError(
            f"the suite {name} of another package calls itself {suite.name!r}; give it one name"
        )
    return suite() if isinstance(suite, type) else suite


def find_presenter(name: str) -> "PlainPresenter":
    """Return the presenter of a suite."""
    from infthor_eval.report.plain import PlainPresenter

    if name in _PRESENTERS.names:
        return _PRESENTERS.load(name, PlainPresenter)()

    from infthor_eval.questions import QuestionSuite

    if isinstance(find_suite(name), QuestionSuite):
        from infthor_eval.report.suites.questions import QuestionsPresenter

        return QuestionsPresenter()

    return PlainPresenter()


def find_request_adapter(name: str) -> "RequestAdapter[Any, Any]":
    """Return the adapter through which lm-eval's requests reach a suite."""
    from infthor_eval.harness.requests import RequestAdapter

    return _REQUESTS.load(name, RequestAdapter)()


def options_class(name: str) -> type:
    """Return the dataclass of a suite's options."""
    return import_target(_BUILT_IN[name].options) if name in _BUILT_IN else find_suite(name).options


def suite_code(name: str) -> dict[str, Any]:
    """Return another package's suite's package, version and source digest; {} for a built-in."""
    from model_adapters.adapter_identity import package_identity

    return {} if name in _BUILT_IN else package_identity(_SUITES.entry_points()[name])


def baseline_suites() -> dict[str, tuple[str, ...]]:
    """Return the suites of each baseline, by its name."""
    suites: dict[str, tuple[str, ...]] = {}
    for name in suite_names():
        for baseline in (
            _BUILT_IN[name].baselines if name in _BUILT_IN else find_suite(name).baselines
        ):
            suites[baseline] = (*suites.get(baseline, ()), name)
    return suites


def split_by_suite(tasks: Iterable["TaskFile"]) -> Mapping[str, list["TaskFile"]]:
    """Return tasks by the name of their suite, in the order given; a run is of one suite."""
    by_suite: dict[str, list[TaskFile]] = {}
    for task in tasks:
        by_suite.setdefault(task.suite, []).append(task)
    return by_suite
