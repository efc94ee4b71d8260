"""The request for a run, checked before anything expensive is loaded."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic

from infthor_eval.errors import UsageError, unknown_name
from infthor_eval.runs.journals.records import Payload, RunHeader, SuiteUnit
from infthor_eval.runs.suite import Evaluation, Suite, TaskRequest
from infthor_eval.storage.files import file_name, plain_name, require_writable
from infthor_eval.storage.once import forget_files
from infthor_eval.workers import WorkerSettings
from model_adapters import check_options, is_known, label, names

IN_MEMORY = "(in memory)"  # name of a model that is an object, in place of one that is loaded
_LONGEST_TASKS = 80  # characters of their names in a folder's


@dataclass(frozen=True)
class RunRequest:
    """A request for a run.

    Attributes:
        model: name of a model, a policy, or a baseline of the suite.
        tasks: the request to the suite.
        task_names: names of tasks and groups as typed, which name the run's folder.
        output: folder above the run's folder.
        model_options: options of the model as typed.
        name: name of the run; None for the checkpoint's name, or the model's.
        fresh: restart, and keep an earlier journal under another name.
        recover: resume without the bad lines of an earlier journal.
        worker_settings: number and place of the workers; no result depends on it.
        include: folders with the user's own task files.
        suite_code: package, version and digest of a suite that is not this package's, as JSON
            values.
    """

    model: str
    tasks: TaskRequest[Any]
    task_names: tuple[str, ...]
    output: Path
    model_options: Mapping[str, str] = field(default_factory=dict)
    name: str | None = None
    fresh: bool = False
    recover: bool = False
    worker_settings: WorkerSettings = field(default_factory=WorkerSettings)
    include: tuple[Path, ...] = ()
    suite_code: Mapping[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Name of the run."""
        return self.name or label(self.model, self.model_options)

    def folder(self, header: RunHeader) -> Path:
        """Return the run's folder."""
        return run_folder(self.output, header, self.task_names)


def run_folder(output: Path, header: RunHeader, tasks: Iterable[str]) -> Path:
    """Return the folder of a run of these tasks, `<output>/<name>/<tasks>-<config hash>`."""
    names = plain_name("+".join(tasks))[:_LONGEST_TASKS]
    return output / file_name(header.name) / f"{names}-{header.config.hash}"


@dataclass(frozen=True)
class PreparedRun(Generic[SuiteUnit, Payload]):
    """A request found in order, with its suite set up; it is pickled and sent to workers."""

    request: RunRequest
    suite: Suite[SuiteUnit, Payload]
    evaluation: Evaluation[SuiteUnit, Payload]


def prepare(
    request: RunRequest, suite: Suite[SuiteUnit, Payload]
) -> PreparedRun[SuiteUnit, Payload]:
    """Check the only request of a command; see `prepare_all`."""
    (run,) = prepare_all([(request, suite)])
    return run


def prepare_all(
    requests: Sequence[tuple[RunRequest, Suite[SuiteUnit, Payload]]],
) -> list[PreparedRun[SuiteUnit, Payload]]:
    """Check the requests of a command before anything expensive is loaded.

    Data that several of them need are read once.

    Raises:
        UsageError: the model or an option is unknown, or the suite refuses the request.
        DataError: the suite's data do not match their format, or the results folder cannot be
            written.
    """
    for request, suite in requests:
        _check(request, suite)  # before the data are read, which may take minutes
    forget_files()
    return [
        PreparedRun(request, suite, suite.prepare(request.tasks)) for request, suite in requests
    ]


def _check(request: RunRequest, suite: Suite[SuiteUnit, Payload]) -> None:
    if request.model not in suite.baselines and not is_known(request.model):
        raise _unknown_model(request.model, [*suite.baselines, *names()])
    if request.model not in suite.baselines:
        check_options(request.model, request.model_options)
    elif request.model_options:
        option = next(iter(request.model_options))
        raise UsageError(
            f"{request.model} has no option {option}, nor any other; of several models, "
            f"MODEL:{option}=VALUE in --model gives it to one"
        )
    require_writable(request.output / file_name(request.label), "--out")


def _unknown_model(name: str, known: Iterable[str]) -> UsageError:
    """Return the error for an unknown model; it names a file here that may be meant."""
    file = Path(f"{name}.py")
    if name.isidentifier() and file.is_file():
        return UsageError(
            f"unknown model {name!r}; if the class in ./{file} is meant, give --model {file}:CLASS"
        )
    return unknown_name("model", name, known)
