"""Our runs in lm-eval's files: results and samples as its own command writes them, for whoever reads those."""

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.digests import canonical_json
from infthor_eval.formats.files import written_atomically
from infthor_eval.harness.registration import NAME
from infthor_eval.runs import RunOutcome, SampleView, TaskFile, UnitRecord
from infthor_eval.statistics import clustered_mean

__all__ = ["export"]

_FILTER = "none"


def export(outcome: RunOutcome) -> Path:
    """Write `lm_eval/<model>/results_<time>.json` and `samples_<task>_<time>.jsonl` into a run's folder.

    Returns:
        The folder with both.

    Raises:
        DataError: they cannot be written.
    """
    model = _sanitised(outcome.run.request.model)
    folder = outcome.folder / "lm_eval" / model
    stamp = datetime.now().isoformat().replace(":", "-")
    hashes = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for task in _tasks(outcome):
            rows = list(_rows(outcome, task))
            hashes[task.name] = _hash(
                "".join(row["doc_hash"] + row["prompt_hash"] + row["target_hash"] for row in rows)
            )
            with written_atomically(folder / f"samples_{task.name}_{stamp}.jsonl") as partial:
                lines = (json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
                partial.write_text("".join(lines), encoding="utf-8")
        with written_atomically(folder / f"results_{stamp}.json") as partial:
            document = _results(outcome) | {"task_hashes": hashes, "model_name_sanitized": model}
            partial.write_text(json.dumps(document, indent=2, ensure_ascii=False), encoding="utf-8")
    except OSError as error:
        raise DataError(
            f"{folder}: cannot be written ({error.strerror}); make room, the journal holds it all"
        ) from error
    return folder


def _tasks(outcome: RunOutcome) -> list[TaskFile]:
    """The tasks of which there are records."""
    there = {record.task for record in outcome.records}
    return [task for task in outcome.run.request.tasks.tasks if task.name in there]


def _of(outcome: RunOutcome, task: TaskFile) -> list[UnitRecord[Any]]:
    return [record for record in outcome.records if record.task == task.name]


def _rows(outcome: RunOutcome, task: TaskFile) -> Iterator[dict[str, Any]]:
    """A sample per line, in the task's order."""
    viewed = [(outcome.run.evaluation.view(record), record) for record in _of(outcome, task)]
    metrics = _metrics([record for _, record in viewed], outcome)
    for view, record in sorted(viewed, key=lambda pair: pair[0].number):
        scores = outcome.run.suite.scores(record)
        yield _row(view) | {"metrics": metrics} | {name: scores.get(name, 0.0) for name in metrics}


def _metrics(records: Sequence[UnitRecord[Any]], outcome: RunOutcome) -> list[str]:
    """Names of the metrics; a failed record has none."""
    return list(dict.fromkeys(name for record in records for name in outcome.run.suite.scores(record)))


def _row(view: SampleView) -> dict[str, Any]:
    return {
        "doc_id": view.number,
        "doc": dict(view.doc),
        "target": view.target,
        "arguments": {"gen_args_0": {"arg_0": view.prompt, "arg_1": dict(view.settings), "arg_2": {"visual": []}}},
        "resps": [[view.reply]],
        "filtered_resps": [view.reply],
        "filter": _FILTER,
        "doc_hash": _hash(json.dumps(view.doc, indent=2, ensure_ascii=False)),
        "prompt_hash": _hash(view.prompt),
        "target_hash": _hash(view.target),
    }


def _hash(text: str) -> str:
    from lm_eval.utils import hash_string

    return str(hash_string(text))


def _results(outcome: RunOutcome) -> dict[str, Any]:
    tasks, request = _tasks(outcome), outcome.run.request
    counts = {task.name: len(_of(outcome, task)) for task in tasks}
    return {
        "results": {task.name: _means(outcome, task) for task in tasks},
        "group_subtasks": {task.name: [] for task in tasks},
        "configs": {task.name: _plain(task.settings) for task in tasks},
        "versions": {task.name: task.settings.get("metadata", {}).get("version") for task in tasks},
        "n-shot": {task.name: 0 for task in tasks},
        "higher_is_better": {task.name: dict.fromkeys(_metrics(_of(outcome, task), outcome), True) for task in tasks},
        "n-samples": {name: {"original": n, "effective": n} for name, n in counts.items()},
        "config": {
            "model": NAME,
            "model_args": {"adapter": request.model, **request.model_options},
            "batch_size": None,
            "batch_sizes": [],
            "limit": request.tasks.limit,
            "bootstrap_iters": 0,
            "gen_kwargs": None,
            "random_seed": request.tasks.seed,
        },
        "date": time.time(),
        "lm_eval_version": version("lm_eval"),
        "transformers_version": version("transformers"),
        "model_source": NAME,
        "model_name": request.model,
    }


def _means(outcome: RunOutcome, task: TaskFile) -> dict[str, Any]:
    records = _of(outcome, task)
    found: dict[str, Any] = {"name": task.name, "alias": task.name, "sample_len": len(records)}
    for metric in _metrics(records, outcome):
        scores = [outcome.run.suite.scores(record).get(metric, 0.0) for record in records]
        estimate = clustered_mean(scores, [record.cluster for record in records])
        found[f"{metric},{_FILTER}"] = estimate.mean
        found[f"{metric}_stderr,{_FILTER}"] = "N/A" if estimate.stderr is None else estimate.stderr
    return found


def _plain(settings: Mapping[str, Any]) -> dict[str, Any]:
    return dict(json.loads(canonical_json(settings)))


def _sanitised(name: str) -> str:
    from lm_eval.utils import sanitize_model_name

    return str(sanitize_model_name(name))
