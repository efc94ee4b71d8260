"""A run whose subject (model, policy or baseline) is loaded, and the records of its groups."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Generic

from infthor_eval.errors import STOPS, ModelError, UsageError, UserCodeError, wrap_user_code
from infthor_eval.runs.journals.record_encoder import RecordEncoder, RefusedRecordError
from infthor_eval.runs.journals.records import (
    Payload,
    RunHeader,
    SuiteUnit,
    Unit,
    UnitKey,
    UnitRecord,
)
from infthor_eval.runs.request import IN_MEMORY, PreparedRun
from infthor_eval.runs.suite import BoundEvaluation, Group, Need, Session, Suite, Workload
from infthor_eval.storage.deadlines import limit_by
from infthor_eval.storage.limits import OWN_CODE_SECONDS
from infthor_eval.workers import WorkerSettings
from model_adapters import (
    BatchModel,
    FramePolicy,
    Model,
    Policy,
    Subject,
    adapter_identity,
    identity_of,
    load,
)

_NEEDED: dict[Need, tuple[Any, str]] = {
    "conversation": (Model, "a model that answers in words"),
    "policy": (Policy | FramePolicy, "a policy that drives an arm (openvla, spatialvla, ...)"),
}


@dataclass(frozen=True)
class BoundRun(Generic[SuiteUnit, Payload]):
    """A run whose subject is loaded, and the header of its journal."""

    prepared: PreparedRun[SuiteUnit, Payload]
    subject: Subject
    evaluation: BoundEvaluation[SuiteUnit, Payload]
    header: RunHeader
    owns_subject: bool = True

    def close(self) -> None:
        """Release the evaluation, then the subject, if it was loaded for this run."""
        with ExitStack() as stack:
            if self.owns_subject:
                stack.callback(self.subject.close)
            problem = f"{self.header.suite}: close() fails"
            stack.enter_context(wrap_user_code(problem, "fix it"))
            stack.enter_context(limit_by(OWN_CODE_SECONDS, problem, UserCodeError))
            stack.callback(self.evaluation.close)


def bind_run(
    run: PreparedRun[SuiteUnit, Payload], loaded: Subject | None = None
) -> BoundRun[SuiteUnit, Payload]:
    """Load the subject of a run, unless it is given, and find its work."""
    subject = _load_subject(run) if loaded is None else loaded
    with ExitStack() as stack:  # released only if anything below raises
        if loaded is None:
            stack.callback(subject.close)
        if run.request.model not in run.suite.baselines:
            require_capability(subject, run.request.model, run.suite)
        evaluation = run.evaluation.bind(subject)
        stack.callback(evaluation.close)
        _require_independent(subject, evaluation.workload, run.request.worker_settings)
        header = _header(run, subject, evaluation.workload)
        stack.pop_all()
    return BoundRun(run, subject, evaluation, header, owns_subject=loaded is None)


def check_runs(runs: Iterable[PreparedRun[Any, Any]]) -> None:
    """Bind each run and release it again, to raise what `bind_run` would when its turn comes.

    Runs that follow each other with one subject load it once; those of a cluster are left to it.
    """
    here = (run for run in runs if run.request.worker_settings.ray_address is None)
    for _, (first, *others) in groupby(here, key=_subject_of):
        with ExitStack() as stack:
            bound = bind_run(first)
            stack.callback(_close_quietly, bound)
            for run in others:
                _close_quietly(bind_run(run, bound.subject))


class SharedSubject:
    """The subject of runs that follow each other and reuse what it has encoded (a context
    manager)."""

    def __init__(self) -> None:
        self._key: tuple[Any, ...] | None = None
        self._subject: Subject | None = None

    def __enter__(self) -> "SharedSubject":
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def of(self, run: PreparedRun[Any, Any]) -> Subject | None:
        """Return the loaded subject of a run, the same one as before where it can be; None for a
        run that loads its own."""
        key = _subject_of(run)
        reuses = getattr(run.evaluation, "reuses_encodings", False)
        if not reuses or not run.request.worker_settings.is_local:
            self._close()
        elif key != self._key:
            self._close()
            self._subject = _load_subject(run)
            self._key = key
        return self._subject

    def _close(self) -> None:
        if self._subject is not None:
            self._subject.close()
        self._key = self._subject = None


def _close_quietly(bound: BoundRun[Any, Any]) -> None:
    with suppress(UserCodeError):  # told by the run itself, beside its results
        bound.close()


def _subject_of(run: PreparedRun[Any, Any]) -> tuple[Any, ...]:
    """Return what the subject of a run is loaded by."""
    request = run.request
    baseline = run.suite.baselines.get(request.model)
    return baseline, request.model, request.model_options, request.tasks.seed


def _header(
    run: PreparedRun[SuiteUnit, Payload], subject: Subject, workload: Workload[SuiteUnit]
) -> RunHeader:
    """Return the header of a run's journal."""
    request = run.request
    is_own = request.model in run.suite.baselines or request.model == IN_MEMORY
    config = workload.config.complete(
        run.suite.name,
        {"name": subject.name, **identity_of(subject)},
        adapter={} if is_own else adapter_identity(request.model),
        suite_code=request.suite_code,
        limit=request.tasks.limit,
        seed=request.tasks.seed,
    )
    return RunHeader(
        suite=run.suite.name,
        name=request.label,
        config=config,
        n_units=workload.n_units,
        units_by_task=workload.units_by_task,
    )


def _load_subject(run: PreparedRun[SuiteUnit, Payload]) -> Subject:
    request = run.request
    if request.model in run.suite.baselines:
        return run.suite.baselines[request.model](request.tasks.seed)
    return load(request.model, request.model_options, request.tasks.seed)


def require_capability(subject: Subject, name: str, suite: Suite[SuiteUnit, Payload]) -> None:
    """Refuse a subject, by its requested name, that lacks what a suite needs (UsageError)."""
    kind, description = _NEEDED[suite.needs]
    if not isinstance(subject, kind):
        raise UsageError(f"{name} cannot be evaluated on {suite.name}, which needs {description}")


def _require_independent(
    subject: Subject, workload: Workload[Any], workers: WorkerSettings
) -> None:
    """Raise UsageError if requests depend on earlier replies, or if there are workers."""
    if not (isinstance(subject, BatchModel) and subject.uses_batches):
        return
    if not workload.independent:
        tasks = ", ".join(workload.units_by_task)
        raise UsageError(
            f"{subject.name}: batch=true asks everything together, but {tasks} asks what depends "
            "on earlier replies; leave out batch"
        )
    if not workers.is_local:
        raise UsageError(
            f"{subject.name}: batch=true leaves the work to the server; leave out --workers"
        )


def group_records(
    evaluation: BoundEvaluation[SuiteUnit, Payload],
    group: Group[SuiteUnit],
    session: Session[Payload],
    encoder: RecordEncoder[Payload],
) -> Iterator[UnitRecord[Payload]]:
    """Yield the records of a group, whatever the suite raises; units without one have failed.

    So has a unit whose record the journal cannot hold: that is the fault of who gave what is in it,
    and of no other unit.

    Raises:
        MemoryError: the machine has no more memory; the run ends.
    """
    units = {unit.key: unit for unit in group.units}
    waiting = dict(units)
    records: Iterator[UnitRecord[Payload]] | None = None
    fault: BaseException
    # No loop over the records with a `yield` in the `try`: it would catch what ends this generator.
    while True:
        try:
            records = records or iter(evaluation.run(group, session))
            record = next(records)
            unit = _unit_of(record, units)
        except StopIteration:
            fault = ModelError("the suite gives no record of it; fix the suite")
            break
        except (MemoryError, *STOPS):  # the next group would have no more memory than this one
            raise
        except BaseException as error:  # noqa: BLE001 - a suite is anybody's code, see STOPS
            fault = error
            break
        waiting.pop(record.key, None)
        yield _kept(record, unit, session, encoder)
    for unit in waiting.values():
        yield unit.record_failure(session.describe_failure(unit, fault))


def _unit_of(record: UnitRecord[Payload], units: Mapping[UnitKey, Unit[Payload]]) -> Unit[Payload]:
    unit = units.get(record.key)
    if unit is None:
        raise ModelError(
            f"the suite gives a record of {record.key!r:.200}, no unit of its group; fix the suite"
        )
    return unit


def _kept(
    record: UnitRecord[Payload],
    unit: Unit[Payload],
    session: Session[Payload],
    encoder: RecordEncoder[Payload],
) -> UnitRecord[Payload]:
    """Return a record that the journal can hold, or else that of its unit's failure."""
    try:
        encoder.encode(record)
    except RefusedRecordError as error:
        return unit.record_failure(session.describe_failure(unit, error))
    return record
