"""What the page on a run shows, worked out from its folder as it grows, and the page's routes."""

import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from infthor_eval.errors import InfthorError, wrap_errors
from infthor_eval.pages.server import file_route
from infthor_eval.rates import Rate
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run
from infthor_eval.runs import NOTHING, RunHeader, RunSummary, UnitRecord, Usage
from infthor_eval.runs.journals.following import FollowedJournal, is_written
from infthor_eval.runs.journals.shards import FOLDER
from infthor_eval.runs.stored.search import Results, read_results, run_folders
from infthor_eval.suites import find_suite

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.routing import Route

Status = Literal["waiting", "running", "ended", "stopped", "done", "unknown"]

_N_NEWEST = 30  # samples that are shown
_N_FAILURES = 50
_LONGEST = 2000  # characters of a text
# times as long as the metrics took they rest, so that they take a tenth of a processor at most
_REST = 9


class LiveSample(msgspec.Struct, frozen=True):
    """A sample: texts as they are in the journal, cut if they are very long; times in seconds.

    Attributes:
        outcome: see `Run.outcome`.
        reason: why it failed or does not count.
        tokens: of the contexts and of the replies; None if they are not counted.
    """

    task: str
    id: str
    title: str
    target: str
    reply: str
    outcome: str
    reason: str
    scores: Mapping[str, float]
    seconds: float
    tokens: tuple[int | None, int | None]


class Totals(msgspec.Struct, frozen=True):
    """Sums over the samples that are there.

    Attributes:
        seconds: of all samples, in seconds of each; more than on the clock if several are evaluated
            at once.
        reasons: number of samples without a result by reason, the most frequent first.
    """

    n_done: int = 0
    n_failed: int = 0
    n_not_asked: int = 0
    n_excluded: int = 0
    seconds: float = 0.0
    usage: Usage = NOTHING
    reasons: tuple[tuple[str, int], ...] = ()


class LiveState(msgspec.Struct, frozen=True, kw_only=True):
    """The run at a moment.

    Attributes:
        status: "waiting" before its first line; "running" while a process of this machine holds the
            journal; "done" and "stopped" by its results; "ended" if it has none; "unknown" where
            the system has no list of locks.
        folder: folder of the run, or the one where it is waited for.
        problem: why the journal, or a line of it, cannot be read; empty if all of it can.
        age: seconds since something was written; None before the first line.
        n_units: samples of the run; None if that is not known.
        measure: what the primary metric measures, in words.
        target_label: what a sample's target is called.
        metrics: primary metric of each task.
        failures: samples that failed or were not asked, the newest first.
        newest: the newest samples first.
    """

    status: Status
    folder: str
    problem: str = ""
    name: str = ""
    tasks: tuple[str, ...] = ()
    simulator: str = ""
    age: float | None = None
    n_units: int | None = None
    totals: Totals = Totals()
    measure: str = ""
    target_label: str = ""
    metrics: Mapping[str, Rate] = {}
    failures: tuple[LiveSample, ...] = ()
    newest: tuple[LiveSample, ...] = ()


class LiveRun:
    """A run that is watched; several threads may ask for its state."""

    def __init__(self, folder: Path) -> None:
        """Read nothing yet.

        Args:
            folder: folder of the run, or one above it: the run below it that was written last, once
                there is one.
        """
        self._folder = folder
        self._asking = Lock()
        self._run: Path | None = None
        self._journal: FollowedJournal | None = None
        self._totals = Totals()
        self._metrics: Mapping[str, Rate] = {}
        self._measure = ""
        self._failures: tuple[LiveSample, ...] = ()
        self._has_new_metrics = False
        self._metrics_due = 0.0

    def state(self) -> LiveState:
        """Return the state of the run now."""
        with self._asking:
            folder = str(self._run or self._folder)
            try:
                # Also what is set aside just now.
                with wrap_errors(f"{folder}: cannot be read", "restore it"):
                    return self._read()
            except InfthorError as error:
                return LiveState(status="unknown", folder=folder, problem=str(error))

    def _read(self) -> LiveState:
        self._run = self._run or _newest_run(self._folder)
        if self._run is None:
            return LiveState(status="waiting", folder=str(self._folder))
        if self._journal is None:
            self._journal = FollowedJournal(self._run, find_suite, _N_NEWEST)
        # Before the journal is read: a process that ends meanwhile has written all that is read.
        held = is_written(self._run)
        results = read_results(self._run)
        has_grown = self._journal.read()
        header = self._journal.header
        suite = self._journal.suite
        if header is None or suite is None:
            return LiveState(status="waiting", folder=str(self._run))
        run = Run.held(self._run, suite, RunSummary(header, None))
        if has_grown:
            self._sum_up(run, self._journal)
        self._update_metrics(run, self._journal)
        return LiveState(
            status=_status(held, results),
            problem=next(iter(self._journal.bad_lines), ""),
            folder=str(self._run),
            name=header.name,
            tasks=tuple(run.tasks),
            simulator=run.simulator,
            age=_age(self._run),
            n_units=_n_units(header, results, self._totals.n_done),
            totals=self._totals,
            measure=self._measure or run.presenter.measure,
            target_label=run.presenter.target_label,
            metrics=self._metrics,
            failures=self._failures,
            newest=tuple(_sample(run, record) for record in reversed(self._journal.newest)),
        )

    def _sum_up(self, run: Run, journal: FollowedJournal) -> None:
        records = list(journal.log.units.values())
        states = Counter(record.state for record in records)
        failed = [record for record in records if record.failure is not None]
        reasons = Counter(_cut(record.failure or "") for record in failed)
        self._totals = Totals(
            n_done=len(records),
            n_failed=states["failed"],
            n_not_asked=states["not asked"],
            n_excluded=states["excluded"],
            seconds=sum(record.seconds for record in records),
            usage=journal.log.usage,
            reasons=tuple(reasons.most_common(_N_FAILURES)),
        )
        self._failures = tuple(_sample(run, record) for record in reversed(failed[-_N_FAILURES:]))
        self._has_new_metrics = True

    def _update_metrics(self, run: Run, journal: FollowedJournal) -> None:
        """Work the primary metrics out as `show` does, unless that was done a moment ago."""
        started = time.monotonic()
        if not self._has_new_metrics or started < self._metrics_due:
            return
        summary = run.suite.summarise(run.header, journal.log.records)
        self._metrics = dict(run.suite.primary_metrics(summary))
        measures = (run.presenter.measure_of(task, summary) for task in self._metrics)
        self._measure = ", ".join(dict.fromkeys(measures))
        self._has_new_metrics = False
        ended = time.monotonic()
        self._metrics_due = ended + _REST * (ended - started)


def _newest_run(folder: Path) -> Path | None:
    if not folder.is_dir():
        return None
    journals = [(run / FOLDER, run) for run in run_folders(folder)]
    written = [(journal.stat().st_mtime, run) for journal, run in journals if journal.is_dir()]
    return max(written)[1] if written else None


def _status(is_held: bool | None, results: Results | None) -> Status:
    if is_held:
        return "running"
    if results is not None:
        return "stopped" if results.n_missing else "done"
    return "ended" if is_held is False else "unknown"


def _age(run: Path) -> float:
    return max(0.0, time.time() - max(path.stat().st_mtime for path in (run / FOLDER).iterdir()))


def _n_units(header: RunHeader, results: Results | None, n_done: int) -> int | None:
    if header.n_units is not None or results is None:
        return header.n_units
    return results.n_missing + n_done


def _sample(run: Run, record: UnitRecord[Any]) -> LiveSample:
    sample = Sample(run, record)
    return LiveSample(
        task=record.task,
        id=_cut(str(record.key)),
        title=_cut(sample.question),
        target=_cut(sample.target),
        reply=_cut(sample.reply),
        outcome=sample.outcome,
        reason=_cut(sample.reason),
        scores=run.suite.scores(record),
        seconds=round(record.seconds, 4),
        tokens=(record.tokens.context, record.tokens.reply),
    )


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def live_routes(run: LiveRun) -> "list[Route]":
    """Return the routes of the page on a run, which only read it; needs the extra `page`."""
    from starlette.responses import Response
    from starlette.routing import Route

    def state(_request: "Request") -> Response:
        return Response(msgspec.json.encode(run.state()), media_type="application/json")

    own = __package__
    report = "infthor_eval.report.web"
    files = [("/", own, "live.html"), ("/live.js", own, "live.js"), ("/live.css", own, "live.css")]
    files.append(("/report.css", report, "report.css"))
    files.append(("/look.css", "infthor_eval.pages", "look.css"))
    return [*(file_route(*file) for file in files), Route("/state.json", state)]
