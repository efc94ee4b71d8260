"""Runs as inspect_ai's logs: an `.eval` file for each task of a run.

The file is a zip of JSON documents. It is written here and not by inspect_ai: the package has
eighty others behind it and a new version every few days, its readers take documents with the fields
that are known alone, and here a sample is in memory at a time, frames included.
`tests/exports/test_inspect_log.py` reads the files with the package.
"""

import json
import zipfile
from collections.abc import Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

from infthor_eval.exports.gaps import (
    dataset_name,
    describe_gaps,
    gap_notes,
    task_config,
    task_document,
    task_gaps,
)
from infthor_eval.exports.inspect_samples import SampleWriter, model_usage, sample_summary
from infthor_eval.exports.measures import Measure, counted, find_measures
from infthor_eval.exports.request import ExportRequest, Written
from infthor_eval.exports.samples import unknown_requests
from infthor_eval.exports.subjects import ModelFacts, model_facts
from infthor_eval.reasons import count_reasons
from infthor_eval.report.sample import Sample, TokenCounts
from infthor_eval.run import Run
from infthor_eval.storage.digests import fingerprint
from infthor_eval.storage.files import file_name, write_output, writing_hint

_VERSION = 2  # of inspect_ai's logs
_PROVIDERS = {"transformers": "hf", "vllm": "vllm"}  # its names of engines, which begin a model's
_NO_PLACE = "excluded samples (their reasons are told), and pairs of twins other than as a mean"

Document = dict[str, Any]


def write(runs: Sequence[Run], request: ExportRequest) -> Written:
    """Write a log for each task of runs that has a unit that counts; the same run, the same
    names."""
    paths: list[Path] = []
    notes: list[str] = []
    for run in runs:
        for task, measures in find_measures(run).items():
            log = _Log(run, task, measures)
            paths.append(log.write(request))
            notes += log.problems
        notes += [*gap_notes(run), *unknown_requests(run)]
    frames = "" if request.frames else "; it has one for frames, which --frames attaches"
    return Written(paths, f"{_NO_PLACE}{frames}", notes)


class _Log:
    """The log of one task of a run.

    Attributes:
        problems: why frames are missing, a line each.
    """

    def __init__(self, run: Run, task: str, measures: Sequence[Measure]) -> None:
        self._run = run
        self._task = task
        self._measures = measures
        self._ran = run.changed
        self.problems: list[str] = []

    def write(self, request: ExportRequest) -> Path:
        """Write the file; returns its path."""
        facts = model_facts(self._run, request.model_id)
        find_frames = None
        if request.frames:
            find_frames = self._run.presenter.request_frames(self._run, request.data)
        writer = SampleWriter(_model_name(facts), self._measures, find_frames)
        stamp = self._ran.isoformat(timespec="seconds").replace(":", "-")
        path = request.out / f"{stamp}_{file_name(self._task)}_{self._id}.eval"
        start = {"version": _VERSION, "eval": self._spec(facts), "plan": self._plan()}
        summaries = []
        tokens: list[TokenCounts] = []
        with (
            write_output(path, writing_hint("")) as partial,
            zipfile.ZipFile(partial, "w") as archive,
        ):
            _add(archive, "_journal/start.json", start)
            for record in counted(self._run, self._task):
                sample = Sample(self._run, record, request.data)
                document = writer.write(sample)
                _add(archive, f"samples/{document['id']}_epoch_{document['epoch']}.json", document)
                summaries.append(sample_summary(document))
                tokens += [sample.tokens] if sample.tokens else []
            _add(archive, "summaries.json", summaries)
            _add(archive, "header.json", self._header(start, facts, tokens))
        reasons = count_reasons(("", problem) for problem in writer.problems)
        self.problems = [
            f"{self._run.label}, {self._task}: {n} sample(s) without frames: {reason}"
            for _, reason, n in reasons
        ]
        return path

    @property
    def _id(self) -> str:
        """A short name of the run's task, the same at each export."""
        made_of = {"config": self._run.header.config.hash, "task": self._task}
        return fingerprint(made_of)

    def _spec(self, facts: ModelFacts) -> Document:
        run = self._run
        config = run.header.config
        settings: Mapping[str, Any] = task_config(run, self._task).settings
        records = counted(run, self._task)
        return {
            "eval_id": self._id,
            "run_id": config.hash,
            "created": self._ran.isoformat(),
            "task": run.header.with_frames(self._task),
            "task_id": self._id,
            "task_version": str(settings.get("metadata", {}).get("version", 0)),
            "task_args": task_document(run, self._task),
            "dataset": {
                "name": dataset_name(run, self._task),
                "samples": len({record.key.once for record in records}),
                "sample_ids": list(dict.fromkeys(str(record.key.once) for record in records)),
            },
            "model": _model_name(facts),
            "model_args": dict(facts.identity),
            "config": {
                "limit": config.limit,
                "epochs": max(record.repeat for record in records),
            },
            "packages": {"infthor-eval": config.infthor_eval},
            "metadata": self._about(facts),
        }

    def _about(self, facts: ModelFacts) -> Document:
        run = self._run
        gaps = task_gaps(run, self._task)
        return {
            "suite": run.suite.name,
            "run": facts.name,
            "developer": facts.developer,
            "revision": facts.revision,
            "frames": run.header.config.frames,
            "simulator": run.simulator,
            "seed": run.header.config.seed,
            "is_whole": gaps.is_whole,
            "left_out": describe_gaps(gaps) or "nothing",
            "n_not_attempted": gaps.n_missing,
            "failed_by_reason": dict(gaps.failed),
            "excluded_by_reason": dict(gaps.excluded),
            "skipped_by_reason": dict(gaps.skipped),
        }

    def _plan(self) -> Document:
        known = task_document(self._run, self._task).get("decoding") or {}
        config = {
            "temperature": known.get("temperature"),
            "top_p": known.get("top_p"),
            "max_tokens": known.get("max_new_tokens"),
            "seed": known.get("seed"),
            "stop_seqs": known.get("stop") or None,
        }
        return {"config": {name: value for name, value in config.items() if value is not None}}

    def _header(
        self, start: Document, facts: ModelFacts, tokens: Sequence[TokenCounts]
    ) -> Document:
        gaps = task_gaps(self._run, self._task)
        usage = model_usage(_sum(tokens)) if tokens else None
        # The journal has no time of the start: as long before the end as all units took together.
        seconds = sum(record.seconds for record in counted(self._run, self._task))
        return {
            **{name: start[name] for name in ("version", "eval", "plan")},
            "status": "success" if gaps.n_missing == 0 else "cancelled",
            "results": {
                "total_samples": gaps.n_counted,
                "completed_samples": gaps.n_counted - gaps.n_failed,
                "scores": [_score(measure) for measure in self._measures],
            },
            "stats": {
                "started_at": (self._ran - timedelta(seconds=seconds)).isoformat(),
                "completed_at": self._ran.isoformat(),
                "model_usage": {_model_name(facts): usage} if usage else {},
            },
        }


def _model_name(facts: ModelFacts) -> str:
    """Return a model's name as inspect has it: the engine's, the developer's, its own."""
    provider = _PROVIDERS.get(facts.engine)
    return facts.id if provider is None else f"{provider}/{facts.id}"


def _score(measure: Measure) -> Document:
    estimate = measure.estimate
    values = {"mean": estimate.mean}
    if estimate.stderr is not None and not measure.resampled:
        values["stderr"] = estimate.stderr
    interval = measure.interval
    if interval is not None:
        values |= dict(zip(("ci_low", "ci_high"), interval, strict=True))
    return {
        "name": measure.metric,
        "scorer": measure.metric,
        "scored_samples": estimate.n,
        "metrics": {name: {"name": name, "value": value} for name, value in values.items()},
        "metadata": {
            "is_primary": measure.is_primary,
            "interval": measure.method,
            "bounds": [str(bound) for bound in measure.bounds],
            "n_trajectories": estimate.n_clusters,
        },
    }


def _sum(tokens: Sequence[TokenCounts]) -> TokenCounts:
    return TokenCounts(
        sum(it.context for it in tokens),
        sum(it.cached for it in tokens),
        sum(it.reply for it in tokens),
    )


def _add(archive: zipfile.ZipFile, name: str, document: Any) -> None:
    content = json.dumps(document, ensure_ascii=False, allow_nan=False)
    member = zipfile.ZipInfo(name)  # of no time of its own
    member.external_attr = 0o644 << 16
    archive.writestr(member, content.encode("utf-8", "backslashreplace"), zipfile.ZIP_DEFLATED)
