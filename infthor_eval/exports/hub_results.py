"""Runs in the Hugging Face hub's files: a model's results, and a data set's list of tasks.

`<developer>/<model>/.eval_results/<file>.yaml` is for the repository of the model,
`<owner>/<data set>/eval.yaml` for that of the data set (docs/hub/eval-results.md of the hub's
documentation). Nothing is uploaded.
"""

from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.exports.gaps import describe_gaps, gap_notes, task_gaps
from infthor_eval.exports.measures import Measure, find_measures
from infthor_eval.exports.request import ExportRequest, Written
from infthor_eval.exports.subjects import UNKNOWN, ModelFacts, model_facts
from infthor_eval.formats.own_folder import OWN_FRAMES
from infthor_eval.run import Run
from infthor_eval.storage.files import file_name, write_atomically, writing_hint

_FOLDER = ".eval_results"
_FRAMEWORK = "infthor-eval"
_NO_PLACE = (
    "samples, other metrics than the primary one, and versions and settings other than in words"
)
_DESCRIPTION = (
    "Needles in an embodied haystack, and tasks for agents and arms, on long trajectories in homes "
    "(∞-THOR)."
)


def write(runs: Sequence[Run], request: ExportRequest) -> Written:
    """Write the results of runs, and the list of their tasks."""
    if request.dataset is None:
        raise UsageError("--format hf-eval-results: results name their data set; give --dataset")
    paths: dict[Path, None] = {}
    notes = []
    for run in runs:
        facts = model_facts(run, request.model_id)
        paths[_write_results(run, facts, request)] = None
        notes += gap_notes(run)
        if facts.developer == UNKNOWN:
            notes.append(f"{run.label}: not known: the model's developer; give --model-id")
    paths[_write_tasks(runs, request)] = None
    notes.append(
        f"the hub takes an eval.yaml only of frameworks in its own list; have {_FRAMEWORK} added "
        "there first (docs/exports.md)"
    )
    return Written(list(paths), _NO_PLACE, notes)


def _write_results(run: Run, facts: ModelFacts, request: ExportRequest) -> Path:
    measures = chain.from_iterable(find_measures(run).values())
    owner = file_name(facts.developer)
    name = file_name(facts.short_name.replace("/", "_"))
    path = request.out / owner / name / _FOLDER / f"{_FRAMEWORK}_{file_name(run.folder.name)}.yaml"
    entries = [_entry(run, facts, measure, request) for measure in measures if measure.is_primary]
    _write_yaml(path, entries)
    return path


def _entry(run: Run, facts: ModelFacts, measure: Measure, request: ExportRequest) -> dict[str, Any]:
    """Return a result in the form of the hub's library, which writes the keys."""
    from huggingface_hub import EvalResultEntry, eval_result_entries_to_yaml

    factor = 100 if measure.is_share else 1  # in percent, as our tables and most of the hub's
    assert request.dataset is not None
    entry = EvalResultEntry(
        dataset_id=request.dataset,
        task_id=run.header.with_frames(measure.task),
        value=round(factor * measure.estimate.mean, 4),
        date=run.changed.isoformat(timespec="seconds"),
        source_url=request.source_url,
        source_name="runs of infthor-eval" if request.source_url else None,
        notes=_notes(run, facts, measure, factor),
    )
    (document,) = eval_result_entries_to_yaml([entry])
    return document


def _notes(run: Run, facts: ModelFacts, measure: Measure, factor: int) -> str:
    unit = "%" if measure.is_share else "points"
    interval = measure.interval
    spread = ""
    if interval is not None:
        low, high = (factor * end for end in interval)
        spread = f", 95 % interval {low:.1f} to {high:.1f}"
    measured = run.presenter.measure_of(measure.task, run.summary.summary)
    left_out = describe_gaps(task_gaps(run, measure.task))
    config = run.header.config
    parts = [
        f"{measured} ({measure.metric}), {unit}{spread}, n = {measure.estimate.n}",
        f"not whole: {left_out}" if left_out else "",
        f"frames: {config.frames}" if config.frames not in ("", "shown") else "",
        f"limit {config.limit}" if config.limit is not None else "",
        _frames_of(run.simulator),
        f"revision {facts.revision}" if facts.revision else "",
        f"{facts.engine} {facts.engine_version}".strip(),
        f"{_FRAMEWORK} {config.infthor_eval}, config {config.hash}",
    ]
    return "; ".join(filter(None, parts))


def _frames_of(simulator: str) -> str:
    if simulator == OWN_FRAMES:
        return simulator
    return f"frames of the {simulator} simulator" if simulator else ""


def _write_tasks(runs: Sequence[Run], request: ExportRequest) -> Path:
    assert request.dataset is not None
    owner, _, name = request.dataset.partition("/")
    tasks = dict.fromkeys(run.header.with_frames(task) for run in runs for task in run.tasks)
    document = {
        "name": name,
        "description": _DESCRIPTION,
        "evaluation_framework": _FRAMEWORK,
        "tasks": [{"id": task, "config": "default", "split": "test"} for task in tasks],
    }
    path = request.out / file_name(owner) / file_name(name) / "eval.yaml"
    _write_yaml(path, document)
    return path


def _write_yaml(path: Path, document: Any) -> None:
    with wrap_errors(f"{path}: cannot be written", writing_hint("")):
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_atomically(path) as partial:
            text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True)
            partial.write_text(text, encoding="utf-8")
