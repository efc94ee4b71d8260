"""Runs in the files of Every Eval Ever (schema 0.3): results, and every sample, of a run.

A run is `data/<collection>/<developer>/<model>/<uuid>.json` with `<uuid>_samples.jsonl` beside it,
as its datastore has them. Both are checked by its own validator in `tests/exports`.
"""

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any
from uuid import UUID

import msgspec

import infthor_eval
from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.exports.every_eval_ever_rows import SCHEMA_VERSION, result_id, sample_rows
from infthor_eval.exports.gaps import (
    dataset_name,
    describe_gaps,
    gap_notes,
    task_document,
    task_gaps,
)
from infthor_eval.exports.measures import LEVEL, Measure, find_measures, scored
from infthor_eval.exports.request import ExportRequest, Written
from infthor_eval.exports.samples import unknown_requests
from infthor_eval.exports.subjects import UNKNOWN, ModelFacts, model_facts
from infthor_eval.run import Run
from infthor_eval.runs.results import results_document
from infthor_eval.storage.digests import fingerprint
from infthor_eval.storage.files import file_name, write_atomically, writing_hint

_NO_PLACE = (
    "frames (their numbers are told), summaries by question type, distance and the like other than "
    "as text, and artifacts of memories"
)

Document = dict[str, Any]


def write(runs: Sequence[Run], request: ExportRequest) -> Written:
    """Write runs; the same run gives files of the same names."""
    paths: list[Path] = []
    notes: list[str] = []
    for run in runs:
        export = _RunExport(run, request)
        written = export.write()
        if written[0] in paths:
            raise DataError(f"{run.folder}: has the config of another of the runs; leave one out")
        paths += written
        notes += [*gap_notes(run), *unknown_requests(run), *export.unknown]
    return Written(paths, _NO_PLACE, notes)


class _RunExport:
    """The files of a run."""

    def __init__(self, run: Run, request: ExportRequest) -> None:
        self._run = run
        self._request = request
        self._facts = model_facts(run, request.model_id)
        self._measures = list(chain.from_iterable(find_measures(run).values()))
        self._ran = run.changed
        self._stamp = f"{self._ran.timestamp():.3f}"
        self._collection = f"infthor-{file_name(run.suite.name)}"

    @property
    def unknown(self) -> list[str]:
        """What is unknown and readers will miss, a line each."""
        missing = {
            "the model's developer; give --model-id": self._facts.developer == UNKNOWN,
            "who made the run; give --organization": self._request.organization
            == ExportRequest.organization,
        }
        return [f"{self._run.label}: not known: {what}" for what, is_so in missing.items() if is_so]

    def write(self) -> list[Path]:
        """Write both files; returns their paths."""
        names = (self._facts.developer, self._facts.short_name.replace("/", "_"))
        place = Path("data", self._collection, *map(_part, names))
        folder = self._request.out / place
        name = str(self._uuid)
        samples = folder / f"{name}_samples.jsonl"
        shared = {"evaluation_id": self._evaluation_id, "model_id": self._facts.id}
        with wrap_errors(f"{folder}: cannot be written", writing_hint("")):
            folder.mkdir(parents=True, exist_ok=True)
            rows = sample_rows(self._run, self._measures, shared)
            n_rows, checksum = _write_lines(samples, rows)
            document = self._document(
                {
                    "format": "jsonl",
                    "file_path": (place / samples.name).as_posix(),
                    "hash_algorithm": "sha256",
                    "checksum": checksum,
                    "total_rows": n_rows,
                }
            )
            with write_atomically(folder / f"{name}.json") as partial:
                text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
                partial.write_text(text + "\n", encoding="utf-8")
        return [folder / f"{name}.json", samples]

    @property
    def _evaluation_id(self) -> str:
        return f"{self._collection}/{self._facts.id}/{self._stamp}"

    @property
    def _uuid(self) -> UUID:
        """A name that a run has for ever: exported again, it replaces its files."""
        made_of = {"config": self._run.header.config.hash, "model": self._facts.id}
        content = hashlib.sha256(fingerprint(made_of).encode()).digest()
        return UUID(bytes=content[:16], version=4)

    def _document(self, samples: Document) -> Document:
        return {
            "schema_version": SCHEMA_VERSION,
            "evaluation_id": self._evaluation_id,
            "evaluation_timestamp": self._ran.isoformat(),
            "retrieved_timestamp": self._stamp,
            "source_metadata": self._source(),
            "eval_library": {
                "name": "infthor-eval",
                "version": self._run.header.config.infthor_eval or infthor_eval.__version__,
                "additional_details": {"suite": self._run.suite.name},
            },
            "model_info": _model_info(self._facts),
            "evaluation_results": [self._result(measure) for measure in self._measures],
            "detailed_evaluation_results": samples,
        }

    def _source(self) -> Document:
        run = self._run
        # All that `results.json` has, the config and the whole summary among it.
        results = results_document(run.summary, run.suite, run.n_missing, run.usage)
        usage = msgspec.to_builtins(run.usage)
        return {
            "source_name": "infthor-eval",
            "source_type": "evaluation_run",
            "source_organization_name": self._request.organization,
            **_if_told("source_organization_url", self._request.source_url),
            "evaluator_relationship": self._request.relationship,
            "additional_details": {
                "results": msgspec.json.encode(results, order="sorted").decode(),
                "usage": json.dumps(usage),
                "seconds": f"{sum(record.seconds for record in run.records):.3f}",
            },
        }

    def _result(self, measure: Measure) -> Document:
        run = self._run
        return {
            "evaluation_result_id": result_id(measure),
            "evaluation_name": run.header.with_frames(measure.task),
            "source_data": self._source_data(measure.task),
            "evaluation_timestamp": self._ran.isoformat(),
            "metric_config": _metric_config(measure, self._describe(measure)),
            "score_details": self._score_details(measure),
            "generation_config": _generation_config(run, measure.task),
        }

    def _describe(self, measure: Measure) -> str:
        run = self._run
        if measure.is_primary:
            return run.presenter.measure_of(measure.task, run.summary.summary)
        return measure.metric

    def _source_data(self, task: str) -> Document:
        run = self._run
        name = dataset_name(run, task)
        about = {"task": task, "simulator": run.simulator or UNKNOWN}
        if self._request.dataset is None:
            return {"dataset_name": name, "source_type": "other", "additional_details": about}
        return {
            "dataset_name": name,
            "source_type": "hf_dataset",
            "hf_repo": self._request.dataset,
            "hf_split": "test",
            "samples_number": len({record.key.once for record in scored(run, task)}),
            "additional_details": about,
        }

    def _score_details(self, measure: Measure) -> Document:
        gaps = task_gaps(self._run, measure.task)
        estimate = measure.estimate
        uncertainty: Document = {"num_samples": estimate.n}
        if estimate.stderr is not None and not measure.resampled:
            method = "analytic, clustered by trajectory"
            uncertainty["standard_error"] = {"value": estimate.stderr, "method": method}
        interval = measure.interval
        if interval is not None:
            low, high = interval
            uncertainty["confidence_interval"] = {
                "lower": low,
                "upper": high,
                "confidence_level": LEVEL,
                "method": measure.method,
            }
        return {
            "score": estimate.mean,
            "details": {
                "is_primary": json.dumps(measure.is_primary),
                "is_whole": json.dumps(gaps.is_whole),
                "left_out": describe_gaps(gaps) or "nothing",
                "n_trajectories": str(estimate.n_clusters),
                "n_not_attempted": UNKNOWN if gaps.n_missing is None else str(gaps.n_missing),
                "failed_by_reason": json.dumps(gaps.failed),
                "excluded_by_reason": json.dumps(gaps.excluded),
                "skipped_by_reason": json.dumps(gaps.skipped),
            },
            "uncertainty": uncertainty,
        }


def _model_info(facts: ModelFacts) -> Document:
    engine = {"name": facts.engine, "version": facts.engine_version}
    return {
        "name": facts.name,
        "id": facts.id,
        "developer": facts.developer,
        **_if_told("inference_platform", facts.platform),
        **({"inference_engine": engine} if facts.engine else {}),
        "additional_details": {
            "deployment_type": facts.deployment,
            "model_availability": facts.availability,
            **_if_told("revision", facts.revision),
            "identity": json.dumps(facts.identity, ensure_ascii=False),
        },
    }


def _metric_config(measure: Measure, description: str) -> Document:
    low, high = measure.bounds
    return {
        "evaluation_description": description,
        "metric_id": f"infthor.{measure.metric}",
        "metric_name": measure.metric,
        "metric_kind": "accuracy" if measure.is_share else "score",
        "metric_unit": "proportion" if measure.is_share else "points",
        "lower_is_better": False,
        "score_type": "continuous",
        "min_score": _bound(low),
        "max_score": _bound(high),
    }


def _generation_config(run: Run, task: str) -> Document:
    config = run.header.config
    document = task_document(run, task)
    decoding = document.get("decoding") or {}
    arguments = {
        "temperature": decoding.get("temperature"),
        "top_p": decoding.get("top_p"),
        "max_tokens": decoding.get("max_new_tokens"),
    }
    return {
        "generation_args": {name: it for name, it in arguments.items() if it is not None},
        "additional_details": {
            "task_config": json.dumps(document, ensure_ascii=False),
            "frames": config.frames or "shown",
            "limit": json.dumps(config.limit),
            "seed": json.dumps(config.seed),
        },
    }


def _part(name: str) -> str:
    """Return a part of a path that its validator takes: no `data`, no dot at the end."""
    part = file_name(name)
    return f"{part}_" if part == "data" or part.endswith(".") else part


def _bound(value: float) -> float | str:
    if math.isinf(value):
        return "Infinity" if value > 0 else "-Infinity"
    return value


def _if_told(name: str, value: str | None) -> Document:
    return {name: value} if value else {}


def _write_lines(path: Path, rows: Iterable[Document]) -> tuple[int, str]:
    """Write a file of JSON lines; returns their number, and the file's hash."""
    hashed = hashlib.sha256()
    n_rows = 0
    with write_atomically(path) as partial, partial.open("wb") as file:
        for row in rows:
            line = json.dumps(row, ensure_ascii=False, allow_nan=False).encode() + b"\n"
            hashed.update(line)
            file.write(line)
            n_rows += 1
    return n_rows, hashed.hexdigest()
