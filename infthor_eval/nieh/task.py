"""A task of NIEH: what its file says, what it asks, and how its samples become records."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import ContextSettings, Sample, context_named
from infthor_eval.nieh.metrics import PUBLISHED, Metrics, metrics_of
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.samples import TaskSamples, find_samples, find_set
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.generation_kwargs import decoding_of
from model_adapters import Decoding

__all__ = ["NiehTask", "PreparedTask"]

_OF_SETS = ("context", "data", "bundled")  # what `dataset_kwargs` takes beside the settings of contexts
_NEEDED = ("custom_dataset", "dataset_kwargs", "doc_to_text", "generation_kwargs", "process_results", "test_split")


@dataclass(frozen=True)
class PreparedTask:
    """How a task's samples become records.

    Attributes:
        found: what it asks.
        decoding: how replies are decoded.
        generation_kwargs: the same in lm-eval's words, as given.
        metrics: what is made of them.
    """

    found: TaskSamples
    decoding: Decoding
    generation_kwargs: Mapping[str, Any]
    metrics: Metrics = PUBLISHED


class NiehTask:
    """A task file, read: what is known of a task before the model is there."""

    def __init__(self, file: TaskFile, request: TaskRequest[NiehOptions]) -> None:
        """Check the file and find what it asks, unless that depends on the model.

        Raises:
            UsageError: a setting that does not fit, or there is no set.
            DataError: the file or the set is not what it should be.
        """
        file.require(*_NEEDED)
        _check(file)
        self.name = file.name
        self.settings: Mapping[str, Any] = file.settings
        self._limit = request.limit
        self._config: dict[str, Any] = _told(request) | file.settings["dataset_kwargs"]
        self.decoding: Decoding = decoding_of(file.settings["generation_kwargs"], request.seed, file.name)
        self.metrics: Metrics = metrics_of(file)
        self.data: NiehSet = find_set(**self._config)
        self.needs_size = context_named(self._config["context"]).needs_model
        self.found: TaskSamples | None = None if self.needs_size else find_samples(self._config, self._limit)

    def prepared(self, tokens_per_frame: int | None) -> PreparedTask:
        """How its samples become records, now that the size of a frame is known where it matters."""
        samples = self.found
        if samples is None:
            samples = find_samples(self._config | {"tokens_per_frame": tokens_per_frame}, self._limit)
        return PreparedTask(samples, self.decoding, self.settings["generation_kwargs"], self.metrics)

    def key(self, prepared: PreparedTask, tokens_per_frame: int | None) -> Sequence[Sample]:
        """All that it would ask without a limit: the answer key that a baseline is fitted to."""
        if self._limit is None:
            return prepared.found.samples
        return find_samples(self._config | {"tokens_per_frame": tokens_per_frame}).samples

    def identity(self, prepared: PreparedTask) -> dict[str, Any]:
        """What its numbers depend on, as JSON values."""
        found, names = prepared.found, prepared.metrics.names
        skipped = [{"question_id": i.question.id, "variant": i.variant, "reason": i.reason} for i in found.skipped]
        return {
            "config": dict(self.settings),
            "decoding": prepared.decoding.document(),
            "metrics": {"names": list(names), **prepared.metrics.identity},
            "data": found.data.fingerprint,
            "simulator": found.data.simulator,
            "sources": dict(found.sources),
            "n_samples": len(found.samples),
            "skipped": skipped,
        }


def _check(file: TaskFile) -> None:
    """Refuse a file with a setting that would not act, as a slip of the pen has it."""
    given = file.settings["dataset_kwargs"]
    if not isinstance(given, Mapping) or not isinstance(given.get("context"), str):
        raise DataError(f"{file.path}: dataset_kwargs must be a mapping with the name of a context (context: NAME)")
    known = (*_OF_SETS, *(item.name for item in fields(ContextSettings)))
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(sorted(known))}"
            raise DataError(f"{file.path}: dataset_kwargs: {key} is not known; {hint}")
    for key in _OF_SETS:
        if not isinstance(given.get(key, ""), str):
            raise DataError(f"{file.path}: dataset_kwargs: {key} is {given[key]!r:.60}; it is a name")


def _told(request: TaskRequest[NiehOptions]) -> dict[str, Any]:
    """What a run tells its tasks beside their files' own settings."""
    ours = {"data": str(request.data) if request.data else None, **asdict(request.options)}
    return {"seed": request.seed} | {key: value for key, value in ours.items() if value is not None}
