"""Our runs in lm-eval's files: results and samples as its own command writes them.

A run writes them at its end, when it has its tasks' data at hand, which every row repeats.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from statistics import fmean
from typing import Any

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.exports import LM_EVAL_MODEL
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run
from infthor_eval.runs import RunOutcome, TaskFile, UnitCounts, UnitDoc
from infthor_eval.runs.journals.shards import last_change
from infthor_eval.statistics import clustered_mean
from infthor_eval.storage.digests import canonical_json
from infthor_eval.storage.files import file_name, write_atomically, writing_hint

_FILTER = "none"
FOLDER = "lm_eval"  # in a run's folder


@dataclass(frozen=True)
class Exported:
    """A run in lm-eval's form.

    Attributes:
        model: name of the model, valid as a folder's name.
        results: contents of `results_*.json`, as JSON values.
        samples: lines of `samples_*.jsonl` by task.
    """

    model: str
    results: dict[str, Any]
    samples: dict[str, list[dict[str, Any]]]


def convert_run(outcome: RunOutcome) -> Exported:
    """Convert a run to lm-eval's form."""
    from lm_eval.utils import sanitize_model_name

    tasks = _tasks(outcome)
    samples = {task.name: _scored_rows(task) for task in tasks}
    hashes = {name: _hash_of_rows(rows) for name, rows in samples.items()}
    model = str(sanitize_model_name(outcome.run.request.model))
    return Exported(
        model,
        _results(outcome, tasks) | {"task_hashes": hashes, "model_name_sanitized": model},
        samples,
    )


def export(outcome: RunOutcome) -> Path:
    """Write lm-eval's files, `results_<time>.json` and `samples_<task>_<time>.jsonl`, for a run.

    Returns:
        The folder with both.
    """
    converted = convert_run(outcome)
    folder = outcome.folder / FOLDER / file_name(converted.model)
    # In local time and without its zone, as lm-eval has it.
    stamp = last_change(outcome.folder).astimezone().replace(tzinfo=None)
    ending = stamp.isoformat(timespec="microseconds").replace(":", "-")
    hint = writing_hint("; the journal holds it all")
    with wrap_errors(f"{folder}: cannot be written", hint):
        folder.mkdir(parents=True, exist_ok=True)
        for task, rows in converted.samples.items():
            name = f"samples_{file_name(task)}"
            with write_atomically(folder / f"{name}_{ending}.jsonl", name) as partial:
                lines = (json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
                partial.write_text("".join(lines), encoding="utf-8")
        with write_atomically(folder / f"results_{ending}.json", "results") as partial:
            partial.write_text(
                json.dumps(converted.results, indent=2, ensure_ascii=False), encoding="utf-8"
            )
    return folder


@dataclass(frozen=True)
class _Task:
    """A task with its samples, and their lines in lm-eval's file without the scores.

    Attributes:
        units: numbers of all its units by state.
    """

    file: TaskFile
    units: UnitCounts
    samples: list[Sample] = field(default_factory=list)
    rows: list[dict[str, Any]] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.file.name

    @property
    def n_samples(self) -> int:
        """Number of samples; one that was repeated has several records."""
        n_known = _n_distinct(self.samples)
        n_repeats = max(sample.record.repeat for sample in self.samples)
        units = self.units
        n_missing = units.answered + units.failed + units.not_asked - len(self.samples)
        return n_known + n_missing // n_repeats

    @property
    def n_answered(self) -> int:
        """Number of samples with a result."""
        return _n_distinct(self.answered)

    @cached_property
    def answered(self) -> list[Sample]:
        """Samples with a result."""
        return [sample for sample in self.samples if sample.is_answered]

    @cached_property
    def metrics(self) -> list[str]:
        return list(dict.fromkeys(name for sample in self.answered for name in sample.scores))


def _n_distinct(samples: Sequence[Sample]) -> int:
    """Return the number of samples, each counted once however often it was repeated."""
    return len({sample.record.key.once for sample in samples})


def _tasks(outcome: RunOutcome[Any, Any]) -> list[_Task]:
    """Return the tasks with samples that count."""
    run = Run.held(outcome.folder, outcome.run.suite, outcome.summary)
    units = run.units
    tasks = {
        file.name: _Task(file, units.get(file.name, UnitCounts()))
        for file in outcome.run.request.tasks.tasks
    }
    for record, doc in zip(outcome.records, outcome.docs, strict=True):
        if record.excluded is None:
            row = _row(doc)
            if record.failure is not None:
                row["failure"] = record.failure  # why there is no reply; a key of our own
            tasks[record.task].samples.append(Sample(run, record))
            tasks[record.task].rows.append(row)
    return [task for task in tasks.values() if task.samples]


def _scored_rows(task: _Task) -> list[dict[str, Any]]:
    """Return a row per sample, in the task's order; repeats give all replies and mean scores.

    A sample without a result has no scores (null), and says why under `infthor_eval`.
    """
    repeated: dict[int, list[tuple[dict[str, Any], Sample]]] = {}
    for row, sample in zip(task.rows, task.samples, strict=True):
        repeated.setdefault(row["doc_id"], []).append((row, sample))
    rows = []
    for _, same in sorted(repeated.items()):
        replies = [reply for row, _ in same for reply in row["filtered_resps"]]
        first, sample = same[0]
        answered = [sample for _, sample in same if sample.is_answered]
        rows.append(
            first | {"resps": [replies], "filtered_resps": replies, "metrics": task.metrics}
        )
        for name in task.metrics:
            values = [sample.scores.get(name, 0.0) for sample in answered]
            rows[-1][name] = fmean(values) if values else None
        if not answered:
            failure = {"state": sample.record.state, "failure": sample.record.failure}
            rows[-1]["infthor_eval"] = failure
    return rows


def _hash_of_rows(rows: Sequence[Mapping[str, Any]]) -> str:
    return _hash("".join(row["doc_hash"] + row["prompt_hash"] + row["target_hash"] for row in rows))


def _row(unit: UnitDoc) -> dict[str, Any]:
    return {
        "doc_id": unit.number,
        "doc": dict(unit.doc),
        "target": unit.target,
        "arguments": {
            "gen_args_0": {
                "arg_0": unit.prompt,
                "arg_1": dict(unit.settings),
                "arg_2": {"visual": []},
            }
        },
        "resps": [[unit.reply]],
        "filtered_resps": [unit.reply],
        "filter": _FILTER,
        "doc_hash": _hash(json.dumps(unit.doc, indent=2, ensure_ascii=False)),
        "prompt_hash": _hash(unit.prompt),
        "target_hash": _hash(unit.target),
    }


def _hash(text: str) -> str:
    from lm_eval.utils import hash_string

    return str(hash_string(text))


def _results(outcome: RunOutcome, tasks: Sequence[_Task]) -> dict[str, Any]:
    request = outcome.run.request
    return {
        "results": {task.name: _means(task) for task in tasks},
        "group_subtasks": {task.name: [] for task in tasks},
        "configs": {task.name: json.loads(canonical_json(task.file.settings)) for task in tasks},
        "versions": {
            task.name: task.file.settings.get("metadata", {}).get("version") for task in tasks
        },
        "n-shot": {task.name: 0 for task in tasks},
        "higher_is_better": {task.name: dict.fromkeys(task.metrics, True) for task in tasks},
        "n-samples": {
            task.name: {"original": task.n_samples, "effective": task.n_answered} for task in tasks
        },
        "config": {
            "model": LM_EVAL_MODEL,
            "model_args": {"adapter": request.model, **request.model_options},
            "batch_size": None,
            "batch_sizes": [],
            "limit": request.tasks.limit,
            "bootstrap_iters": 0,
            "gen_kwargs": None,
            "random_seed": request.tasks.seed,
        },
        # A key of our own: what these scores are of.
        "infthor_eval": {
            "version": outcome.summary.header.config.infthor_eval,
            "units": msgspec.to_builtins(outcome.summary.units),
        },
        "date": last_change(outcome.folder).timestamp(),
        "lm_eval_version": version("lm_eval"),
        "transformers_version": version("transformers"),
        "model_source": LM_EVAL_MODEL,
        "model_name": request.model,
    }


def _means(task: _Task) -> dict[str, Any]:
    means: dict[str, Any] = {"name": task.name, "alias": task.name, "sample_len": task.n_answered}
    for metric in task.metrics:
        scores = [sample.scores.get(metric, 0.0) for sample in task.answered]
        estimate = clustered_mean(scores, [sample.record.cluster for sample in task.answered])
        means[f"{metric},{_FILTER}"] = estimate.mean
        means[f"{metric}_stderr,{_FILTER}"] = "N/A" if estimate.stderr is None else estimate.stderr
    return means
