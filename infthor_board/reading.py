"""What a stranger sends: a folder with a statement, and runs or exports of NIEH."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from msgspec.structs import replace

from infthor_board.exports import ExportedScores, read_exported_scores
from infthor_board.statement import Statement, read_statement
from infthor_eval.errors import DataError, InfthorError, UsageError, describe_exception, wrap_errors
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.published.imported_replies import ImportedRun, import_logs
from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.run import Run
from infthor_eval.runs import RunHeader, UnitKey, UnitRecord
from infthor_eval.runs.journals.shards import find_shards, parse_record, read_lines
from infthor_eval.runs.stored.search import run_folders

Record = UnitRecord[NiehAnswer]
_EXPORTS = (".jsonl", ".jsonl.gz", ".eval")
_SUITE = "nieh"

# Returns the set that a task of ours asks about; raises InfthorError if there is none.
FindSet = Callable[[str], NiehSet]


@dataclass(frozen=True)
class Problem:
    """Why a submission is refused, or what is to be known of it.

    Attributes:
        check: name of the check.
        text: the reason, in a sentence.
        is_warning: True if it does not refuse the submission.
    """

    check: str
    text: str
    is_warning: bool = False


@dataclass(frozen=True)
class SubmittedRun:
    """A run of a submission.

    Attributes:
        path: folder of the run, or file of the export.
        header: its header; of an export, as `import-replies` makes it.
        records: the latest record of each unit.
        results: every record with a reply, also those that a later one replaced.
        stated: scores that it states for its units, by metric.
        stated_models: names of models that an export states.
        unread: rows of an export that are no replies to questions of the set, with the reason.
        is_export: True for an export, which has no hashes of requests.
    """

    path: Path
    header: RunHeader[NiehConfig]
    records: Sequence[Record]
    results: Sequence[Record]
    stated: Mapping[UnitKey, Mapping[str, float]]
    stated_models: Sequence[str] = ()
    unread: Sequence[str] = ()
    is_export: bool = False


@dataclass(frozen=True)
class Submission:
    """A submission as it was sent.

    Attributes:
        folder: its folder.
        statement: what its submitter says; None if that cannot be read.
        runs: its runs.
        problems: what cannot be read, with the reason.
    """

    folder: Path
    statement: Statement | None
    runs: Sequence[SubmittedRun] = ()
    problems: Sequence[Problem] = field(default_factory=tuple)

    @property
    def name(self) -> str:
        """Name of its folder, by which messages call it."""
        return self.folder.resolve().name


def read_submission(folder: Path, find_set: FindSet) -> Submission:
    """Read a submission; whatever cannot be read is a problem of it."""
    problems: list[Problem] = []
    runs: list[SubmittedRun] = []
    statement = None
    try:
        files = _files(folder)
        folders = list(run_folders(folder))
    except InfthorError as error:
        return Submission(folder, None, problems=[Problem("readable", str(error))])
    try:
        statement = read_statement(folder)
    except InfthorError as error:
        problems.append(Problem("identity", str(error)))
    readers = [lambda path=path: [_read_journal(path)] for path in folders]
    if statement is not None:
        known = statement
        readers += [
            lambda path=path: _read_export(path, known, find_set)
            for path in files
            if path.name.endswith(_EXPORTS) and set(folders).isdisjoint(path.parents)
        ]
    for read in readers:
        try:
            runs += read()
        except Exception as error:  # noqa: BLE001 - see `describe`
            problems.append(Problem("readable", describe(error)))
    if not runs and not problems:
        problems.append(Problem("readable", f"{folder}: no run and no export in it; add them"))
    return Submission(folder, statement, runs, problems)


def describe(error: Exception) -> str:
    """Return any error as a reason: one submission's file must not end the check of others."""
    return str(error) if isinstance(error, InfthorError) else describe_exception(error)


def _files(folder: Path) -> list[Path]:
    """Return all files of a submission, sorted."""
    files = []
    found = [folder]
    with wrap_errors(f"{folder}: cannot be searched", "make it readable, and less deep"):
        for path in found:  # which grows: folders may be nested deeper than functions
            if path.is_symlink():
                raise DataError(f"{path}: is a link, which is not followed; send what it leads to")
            if path.is_dir():
                found += path.iterdir()
            elif path.is_file():
                files.append(path)
    return sorted(files)


def _read_journal(folder: Path) -> SubmittedRun:
    run = Run.open(folder)
    if run.listed.suite != _SUITE:
        raise UsageError(
            f"{folder}: a run of {run.listed.suite}; only replies can be scored again, so send "
            f"runs of {_SUITE}"
        )
    header = run.own_header
    results = [it for it in _all_records(folder, header) if it.payload.reply is not None]
    stated = {record.key: record.payload.scores for record in run.records}
    return SubmittedRun(folder, header, run.records, results, stated)


def _all_records(folder: Path, header: RunHeader[NiehConfig]) -> Iterator[Record]:
    decoder = RECORDS.decoder()
    for path in find_shards(folder):
        for number, line in enumerate(read_lines(path)[1:], 2):
            record = parse_record(path, number, line, decoder, header)
            if isinstance(record, UnitRecord):
                yield record


def _read_export(path: Path, statement: Statement, find_set: FindSet) -> list[SubmittedRun]:
    scores = read_exported_scores(path)
    tasks = sorted(scores.tasks) or [statement.task]
    if tasks == [""]:
        raise DataError(
            f"{path}: does not tell its task; name it in submission.yaml (task: nieh_mini_gt)"
        )
    of_sets: dict[NiehSet, list[str]] = {}
    for task in tasks:
        of_sets.setdefault(find_set(task), []).append(task)
    return [
        _exported_run(path, run, scores, data, names[0])
        for data, names in of_sets.items()
        for run in import_logs([path], data, statement.model, names)
    ]


def _exported_run(
    path: Path, run: ImportedRun, scores: ExportedScores, data: NiehSet, task: str
) -> SubmittedRun:
    """Return a run of an export; one that does not tell its task is of the given one."""
    stated = {record.key: scores.of(run.task, record.key) for record in run.records}
    if run.task not in scores.tasks:
        stated = {key._replace(task=task): of_unit for key, of_unit in stated.items()}
        run.records[:] = [replace(record, task=task) for record in run.records]
        run.task = task
    return SubmittedRun(
        path,
        run.header(data),
        run.records,
        [record for record in run.records if record.payload.reply is not None],
        stated,
        sorted(scores.models),
        [f"line {row.line} {row.reason}" for row in run.refused],
        is_export=True,
    )
