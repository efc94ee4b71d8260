"""One run of any suite: what is evaluated, its journal, and the order of its work."""

import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import msgspec

from infthor_eval.errors import InfthorError, UsageError, in_one_line, naming, unknown_name
from infthor_eval.formats.digests import fingerprint
from infthor_eval.formats.files import require_writable, written_atomically
from infthor_eval.runs import journal as journals
from infthor_eval.runs.executor import evaluated
from infthor_eval.runs.identity import identity_of
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import RunHeader, UnitRecord
from infthor_eval.runs.session import JournalSession
from infthor_eval.runs.suite import Evaluation, Group, RunSummary, Suite, TaskRequest, Workload
from infthor_eval.runs.usage import Usage
from model_adapters import Model, Policy, Subject, adapter_identity, check_options, label, load, names

__all__ = ["Observer", "PreparedRun", "RunOutcome", "RunRequest", "Silent", "execute", "prepare"]

_RESULTS = "results.json"


@dataclass(frozen=True)
class RunRequest:
    """What a user asked for.

    Attributes:
        model: name of a model, a policy, or one of the suite's baselines.
        tasks: what the suite is asked.
        asked: the names of tasks and groups as typed, which name the run's folder.
        output: folder that takes the run's own folder.
        model_options: the model's options as typed.
        name: what the run is called; None takes the checkpoint's name, or the model's.
        fresh: set an earlier journal aside and start anew.
        recover: go on without the bad lines of an earlier journal.
    """

    model: str
    tasks: TaskRequest
    asked: tuple[str, ...]
    output: Path
    model_options: Mapping[str, str] = field(default_factory=dict)
    name: str | None = None
    fresh: bool = False
    recover: bool = False

    @property
    def label(self) -> str:
        """What the run is called."""
        return self.name or label(self.model, self.model_options)


class Observer(Protocol):
    """Is told how a run goes."""

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """All that will be done, before the first unit; and how many bad lines were taken out of the journal."""
        ...

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """A unit is done; or was found in the journal of an earlier, stopped run."""
        ...


class Silent:
    """An observer that says nothing."""

    def begin(self, workload: Workload, n_recovered: int) -> None:
        """Nothing."""

    def done(self, record: UnitRecord[Any], resumed: bool) -> None:
        """Nothing."""


@dataclass(frozen=True)
class PreparedRun:
    """A request whose names, files and data have been found to be in order."""

    request: RunRequest
    suite: Suite
    evaluation: Evaluation


@dataclass(frozen=True)
class RunOutcome:
    """A finished run.

    Attributes:
        folder: the run's own.
        run: what it was made from.
        summary: who it was, and what it found.
        records: of every unit.
        usage: what all its requests took, those for memos with them.
    """

    folder: Path
    run: PreparedRun
    summary: RunSummary
    records: list[UnitRecord[Any]]
    usage: Usage


def prepare(request: RunRequest, suite: Suite) -> PreparedRun:
    """Check a request before anything expensive is loaded.

    Raises:
        UsageError: an unknown model or option, or what the suite refuses.
        DataError: the suite's data are not what their format says, or the results folder cannot be written to.
    """
    if request.model not in {*suite.baselines, *names()}:
        raise unknown_name("model", request.model, [*suite.baselines, *names()])
    if request.model not in suite.baselines:
        check_options(request.model, request.model_options)  # refused before the data are read
    elif request.model_options:
        raise UsageError(f"{request.model} has no option {next(iter(request.model_options))}, nor any other")
    require_writable(request.output / request.label, "--output")
    return PreparedRun(request, suite, suite.prepare(request.tasks))


def execute(run: PreparedRun, observer: Observer | None = None) -> RunOutcome:
    """Load the model, do what the journal does not hold yet, and write the results.

    The folder `<output>/<name>/<tasks>-<identity>/` holds the journal and `results.json`.

    Args:
        run: what `prepare` found.
        observer: is told how it goes.

    Raises:
        UsageError: another process at the same run, a subject that the suite cannot evaluate, or nothing to do.
        ModelError: the model cannot be loaded.
        DataError: the journal has a bad line, or the results cannot be written.
    """
    observer = observer or Silent()
    subject = _subject(run)
    try:
        workload = run.evaluation.workload(subject)
        header = _header(run, subject, workload)
        folder = _folder(run.request, header)
        n_recovered = _open_anew(run, folder, header)
        with Journal(folder, header, run.suite.records) as journal:
            observer.begin(workload, n_recovered)
            _evaluate(run.evaluation, workload, JournalSession(subject, journal), observer)
            records = _asked(workload, journal)
            usage = Usage.total([record.usage for record in records] + [memo.usage for memo in journal.memos])
            journal.require_there()
    finally:
        run.evaluation.close()
        subject.close()
    summary = RunSummary(header, run.suite.summarise(header, records))
    _write_results(folder, summary, usage)
    return RunOutcome(folder, run, summary, records, usage)


def _subject(run: PreparedRun) -> Subject:
    request, suite = run.request, run.suite
    if request.model in suite.baselines:
        return suite.baselines[request.model](request.tasks.seed)
    subject = load(request.model, request.model_options, request.tasks.seed)
    wanted: type = {"conversation": Model, "policy": Policy}[suite.needs]
    if not isinstance(subject, wanted):
        subject.close()
        raise UsageError(f"{request.model} cannot be evaluated on {suite.name}, which needs a {suite.needs}")
    return subject


def _header(run: PreparedRun, subject: Subject, workload: Workload) -> RunHeader:
    request = run.request
    code = {} if request.model in run.suite.baselines else adapter_identity(request.model)
    tasks = request.tasks
    identity = identity_of(run.suite.name, subject, code, workload.identity, tasks.limit, tasks.seed)
    return RunHeader(suite=run.suite.name, name=request.label, identity=identity)


def _folder(request: RunRequest, header: RunHeader) -> Path:
    return request.output / header.name / f"{'+'.join(request.asked)[:80]}-{fingerprint(header.identity)}"


def _open_anew(run: PreparedRun, folder: Path, header: RunHeader) -> int:
    """What --fresh and --recover do to an earlier journal; how many bad lines were taken out of it."""
    if run.request.fresh:
        journals.set_aside(folder)
    return journals.recover(folder, header, run.suite.records) if run.request.recover else 0


def _asked(workload: Workload, journal: Journal) -> list[UnitRecord[Any]]:
    """The records of what this run asks; the journal may know more."""
    asked = {unit.key for group in workload.groups for unit in group.units}
    return [record for record in journal.records if record.key in asked]


def _evaluate(evaluation: Evaluation, workload: Workload, session: JournalSession, observer: Observer) -> None:
    in_flight = session.subject.capabilities.max_in_flight
    for record in evaluated(workload.groups, lambda group: _records(evaluation, group, session), in_flight):
        observer.done(*session.recorded(record))


def _records(evaluation: Evaluation, group: Group, session: JournalSession) -> Iterator[UnitRecord[Any]]:
    """The records of a group; units that it came to no record of have failed, and no other group with them."""
    waiting = {unit.key: unit for unit in group.units}
    reason = "the suite gives no record of it; mend the suite"
    try:
        for record in evaluation.run(group, session):
            msgspec.json.encode(record)  # what cannot be written is to fail here, not where the journal writes it
            waiting.pop(record.key, None)
            yield record
    except InfthorError as error:
        reason = str(error)
    except MemoryError:  # of the machine, and not of the group alone
        raise
    except Exception as error:  # noqa: BLE001 - a suite is anybody's code, and its fault is recorded whatever it is
        reason = _fault(error)
    yield from (unit.failed(reason) for unit in waiting.values())


def _fault(error: Exception) -> str:
    """What a programming error is, where, and what it says."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(place.filename).name}:{place.lineno} ({place.name})"
    return f"{type(error).__name__} in {where}: {in_one_line(error)}; mend the suite and run the same command again"


def _write_results(folder: Path, found: RunSummary, usage: Usage) -> None:
    header = found.header
    document = {
        "suite": header.suite,
        "name": header.name,
        "identity": header.identity,
        "summary": found.summary,
        # Not what was cached: that differs between a run and the same run resumed.
        "usage": {name: getattr(usage, name) for name in ("requests", "context", "reply", "cost")},
    }
    path = folder / _RESULTS
    with (
        naming(f"{path}: cannot be written", "make room, the journal holds it all"),
        written_atomically(path) as partial,
    ):
        encoded = msgspec.json.encode(document, order="sorted")
        partial.write_bytes(msgspec.json.format(encoded, indent=2) + b"\n")
