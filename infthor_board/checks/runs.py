"""Whether runs are what they say: of one model, on all questions of our set, with the scores of
their replies."""

import re
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from statistics import fmean
from typing import Any

from infthor_board.case import Case, check, count
from infthor_board.expected import Expected
from infthor_board.exports import read_exported_means
from infthor_board.reading import SubmittedRun
from infthor_board.statement import Statement
from infthor_eval.formats.reading import json_lines_of
from infthor_eval.nieh.config import MetricsConfig
from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import SCORERS, plain_form, scores
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.runs import RunSummary, UnitRecord
from infthor_eval.runs.stored.search import read_results
from infthor_eval.storage.digests import canonical_json

_ID = re.compile(r"[\w.-]+/[\w.-]+")
_FOLDER = re.compile(r".+-(?P<hash>[0-9a-f]{16})")
_COMMIT = re.compile(r"[0-9a-f]{7,64}")
_TOMORROW = timedelta(days=1)  # somewhere it is the next day already
_TOLERANCE = 1e-6  # of scores that went through another format's decimals
_ROUNDED = 1e-4  # of means that others may have rounded
_SCORES = "scores.jsonl"
_HINT = "send the run as it was written"
_FAILED = 0.0  # what exports write for a failed unit

Record = UnitRecord[NiehAnswer]


@check("identity")
def complete_identity(case: Case) -> Iterator[str]:
    """The statement has all that a row needs: a row nobody can be asked about, or run again, is
    worth nothing."""
    statement = case.submission.statement
    if statement is None:
        return
    for field in ("revision", "submitted_by", "contact"):
        if not getattr(statement, field).strip():
            yield f"submission.yaml has no {field}; fill it"
    if not _ID.fullmatch(statement.model):
        yield f"model is {statement.model!r:.60}, not DEVELOPER/NAME; write both, as on the hub"
    if statement.date > (datetime.now(UTC) + _TOMORROW).date():
        yield f"date is {statement.date}, which is yet to come; correct it"
    for run in case.submission.runs:
        if run.is_export and not statement.engine.strip():
            yield (
                f"{run.path.name}: an export does not tell what ran the model; name the engine "
                "in submission.yaml"
            )
        if not run.is_export and not run.header.config.model.get("name"):
            yield f"{run.path.name}: its journal names no model; run it again"


@check("model")
def same_model(case: Case) -> Iterator[str]:
    """The runs are of one model, the one that the statement names: the name of one model on the
    replies of another is the oldest forgery."""
    statement = case.submission.statement
    if statement is None:
        return
    runs = [run for run in case.submission.runs if not run.is_export]
    for run in runs:
        for text in _differences(run, statement):
            yield f"{run.path.name}: {text}"
    names = sorted({str(run.header.config.model.get("name", "")) for run in runs})
    if len(names) > 1:
        yield f"its runs are of {', '.join(names)}; send a submission for each model"
    for run in case.submission.runs:
        yield from _other_names(run, statement)


def _other_names(run: SubmittedRun, statement: Statement) -> Iterator[str]:
    """Yield the names that an export has for another model."""
    for stated in sorted(run.stated_models):
        if stated.rpartition("/")[2] != statement.model.rpartition("/")[2]:
            yield (
                f"{run.path.name}: says that it is of {stated!r:.60}, submission.yaml "
                f"{statement.model!r:.60}; make them say the same"
            )


def _differences(run: SubmittedRun, statement: Statement) -> Iterator[str]:
    """Yield what the journal says otherwise; of a folder or a server it knows no name on the hub,
    and no commit."""
    model = run.header.config.model
    recorded = str(model.get("revision") or "")
    if not recorded:
        return
    checkpoint = str(model.get("checkpoint") or "")
    if checkpoint.lower() != statement.model.lower():
        yield (
            f"the journal is of {checkpoint!r:.60}, submission.yaml says {statement.model!r:.60}; "
            "make them say the same"
        )
    stated = statement.revision.strip().lower()
    is_same = recorded.startswith(stated) or stated.startswith(recorded)
    if _COMMIT.fullmatch(recorded) and not is_same:
        yield (
            f"the journal is of revision {recorded[:12]}, submission.yaml says {stated[:12]}; make "
            "them say the same"
        )


@check("config")
def unedited_config(case: Case) -> Iterator[str]:
    """The hash of a run's config is the one in the name of its folder: folders
    are named by what can change a number, so that an edit shows."""
    for run in case.submission.runs:
        named = _FOLDER.fullmatch(run.path.name)
        if run.is_export or named is None or named["hash"] == run.header.config.hash:
            continue
        yield (
            f"{run.path.name}: its journal's config has the hash {run.header.config.hash}; it "
            "was edited, or the folder renamed"
        )


@check("set")
def same_set(case: Case) -> Iterator[str]:
    """The run is on the checker's set, byte for byte: scores on another set, or an edited one, are
    not comparable."""
    for task in case.tasks:
        if task.config is None:
            continue
        theirs = task.stated.data
        if theirs != task.config.data:
            yield (
                f"{task.name}: was asked on a set with fingerprint {theirs[:12]}; that of "
                f"{task.data.root.name} is {task.config.data[:12]}; run it on that set"
            )


@check("task")
def same_task(case: Case) -> Iterator[str]:
    """The task is the installed one of its name: context, words of the question, limits. It may
    be an easier task under a harder one's name."""
    for task in case.tasks:
        if task.config is None:
            continue
        ours = task.config
        theirs = task.stated
        differing = [
            name
            for name in ("dataset_kwargs", "doc_to_text", "doc_to_image", "process_docs")
            if theirs.settings.get(name) != ours.settings.get(name)
        ]
        # Ours are without those of a memory or a retriever, which is not loaded here.
        if not ours.sources.keys() <= theirs.sources.keys() or theirs.film != ours.film:
            differing.append("sources")
        if differing:
            yield (
                f"{task.name}: has other {', '.join(differing)} than the installed task; run "
                "the installed one"
            )


@check("complete")
def all_there(case: Case) -> Iterator[str]:
    """Every question of the set has a record: none missing, left out, or not asked. Leaving out
    hard questions raises a score."""
    if case.tasks and not case.shown:
        yield "all its runs are controls; send the one with the set's own frames"
    for task in case.tasks:
        yield from _left_out(task)


def _left_out(task: Expected) -> Iterator[str]:
    """Yield what of a task is missing, left out or not asked."""
    limit = task.run.header.config.limit
    if limit is not None:
        yield f"{task.name}: was run with --limit {limit}; run it whole"
    if task.config is not None:
        ours = {(it.question_id, it.variant) for it in task.config.skipped}
        skipped = task.stated.skipped
        left_out = [it.question_id for it in skipped if (it.question_id, it.variant) not in ours]
        if left_out:
            yield (
                f"{task.name}: leaves out {count('questions', left_out)} that can be asked; "
                "run it again"
            )
    states = {record.key: record.state for record in task.records}
    for state, what in (("not asked", "were not asked"), ("excluded", "are excluded")):
        keys = [str(key) for key, its in states.items() if its == state]
        if keys:
            yield f"{task.name}: {count('questions', keys)} {what}; resume the run"
    missing = [str(key) for key in task.units if key not in states]
    if missing:
        yield (
            f"{task.name}: {count('questions', missing)} of {len(task.units):,} are missing; "
            "resume the run"
        )


@check("once")
def asked_once(case: Case) -> Iterator[str]:
    """No question has two results: asking until the answer is right is not one answer.

    Two equal results are one that two workers had.
    """
    names = Counter(_run_settings(task) for task in case.tasks)
    for (task, *_), n in names.items():
        if n > 1:
            yield f"{task}: {n} runs with the same settings; send one, or ask with --repeats"
    for run in case.submission.runs:
        replies: dict[Any, set[str]] = {}
        for record in run.results:
            said = plain_form(record.payload.reply or "")
            if record.failure is None:
                replies.setdefault(record.key, set()).add(said)
        twice = [str(key) for key, said in replies.items() if len(said) > 1]
        if twice:
            yield (
                f"{run.path.name}: {count('questions', twice)} were answered twice, and not "
                "the same; send a run that asks once"
            )
        again = [text for text in run.unread if "again" in text]
        if again:
            yield f"{run.path.name}: {count('rows', again)}; give each once"


def _run_settings(task: Expected) -> tuple[str, ...]:
    """Return task, context, frames and memory, of which a submission has one run each."""
    config = task.run.header.config
    kwargs = canonical_json(dict(task.stated.dataset_kwargs))
    memory = (config.memory, config.memory_args, config.budget, config.prompt)
    return task.name, config.frames or SHOWN, kwargs, *map(str, memory)


@check("questions")
def none_of_another_set(case: Case) -> Iterator[str]:
    """Every record is of a question of the set, with the set's own words and gold answers: an
    edited question or key makes a wrong reply right."""
    for task in case.tasks:
        unknown = [str(it.key) for it in task.records if it.key not in task.units]
        if unknown:
            yield (
                f"{task.name}: {count('records', unknown)} are of no question of the set; take "
                "them out"
            )
        edited = [str(it.key) for it in task.records if _is_other_question(task, it)]
        if edited:
            yield (
                f"{task.name}: {count('questions', edited)} have other words or gold answers "
                "than in the set"
            )
    for run in case.submission.runs:
        foreign = [text for text in run.unread if "again" not in text]
        if foreign:
            yield f"{run.path.name}: {count('rows', foreign)} cannot be scored"


def _is_other_question(task: Expected, record: Any) -> bool:
    unit = task.units.get(record.key)
    if unit is None:
        return False
    theirs, ours = record.payload, unit.payload
    return (theirs.question, theirs.answers) != (ours.question, ours.answers)


@check("scorers")
def same_scorers(case: Case) -> Iterator[str]:
    """The metrics of a run are those of its installed task: a scorer of one's own under our
    scorers' names."""
    for task in case.tasks:
        if task.config is not None and _code(task.stated.metrics) != _code(task.config.metrics):
            yield (
                f"{task.name}: was scored by other scorers than the installed task's; run that task"
            )


def _code(metrics: MetricsConfig) -> tuple[object, ...]:
    """Return what tells scorers apart; rules of another version show in the scores."""
    return sorted(metrics.names), metrics.process_results, metrics.source


@check("scores")
def same_scores(case: Case) -> Iterator[str]:
    """Each stored score is the one of its reply: stored scores are not used, but edited ones cast
    doubt on the replies."""
    for run in case.submission.runs:
        edited = [str(record.key) for record in run.records if _is_edited(run, record)]
        if edited:
            yield (
                f"{run.path.name}: {count('stored scores', edited)} are not those of their replies"
            )


def _is_edited(run: SubmittedRun, record: Record) -> bool:
    stated = run.stated.get(record.key, {})
    reply = record.payload.reply
    if record.failure is not None or reply is None:
        return any(stated.get(name, _FAILED) != _FAILED for name in SCORERS)
    if not stated and not run.is_export:
        return True  # an answered unit of a journal has its scores
    right = scores(reply, record.payload.answers)
    return any(abs(stated[name] - right[name]) > _TOLERANCE for name in SCORERS if name in stated)


@check("results")
def same_results(case: Case) -> Iterator[str]:
    """What is summed up beside the replies is what they give: a summary that its own replies do not
    give."""
    for run in case.submission.runs:
        texts = _of_export(run) if run.is_export else _of_journal(run)
        yield from (f"{run.path.name}: {text}" for text in texts)


def _of_journal(run: SubmittedRun) -> Iterator[str]:
    stored = read_results(run.path)
    suite = NiehSuite()
    if stored is not None:
        summary = RunSummary.of(suite, run.header, run.records)
        for task, rate in suite.primary_metrics(summary.summary).items():
            stated = stored.primary_metrics.get(task)
            if stated is None or abs(stated.mean - rate.mean) > _TOLERANCE:
                said = "no score" if stated is None else f"{100 * stated.mean:.2f} %"
                yield (
                    f"results.json has {said} for {task}, its records give {100 * rate.mean:.2f} %"
                )
    path = run.path / _SCORES
    if path.is_file() and not path.is_symlink():
        ours = [dict(suite.scores(record)) for record in run.records]
        theirs = [row.get("scores") for row in json_lines_of(path, _HINT)]
        if theirs != ours:
            yield f"{_SCORES} has other scores than the journal"


def _of_export(run: SubmittedRun) -> Iterator[str]:
    for (task, metric), stated in read_exported_means(run.path).items():
        records = [record for record in run.records if record.task == task]
        given = [it.payload.scores.get(metric) for it in records]
        known = [score for score in given if score is not None]
        if not known:
            continue
        mean = fmean(known)  # failed units are in no mean
        if abs(stated - mean) > _ROUNDED:
            yield (
                f"its results have {100 * stated:.2f} % for {task} ({metric}), its replies "
                f"give {100 * mean:.2f} %"
            )
