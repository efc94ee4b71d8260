"""The metrics of a task's replies: our scorers, or the task's own function.

A task file lists under `metric_list` which of our scorers it has. It may name its own function
under `process_results`, with its metrics under `metric_list`, as in lm-eval.
"""

import importlib
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

from infthor_eval.errors import STOPS, DataError, in_one_line
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.docs import Doc, doc_of
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.scoring import SCORERS, STRICT_RULES, scores
from infthor_eval.pairs import PAIR_BOUNDS
from infthor_eval.quantities import require_number
from infthor_eval.questions.asking import wrap_metric_errors
from infthor_eval.runs.catalog import TaskFile
from infthor_eval.storage.digests import digest_of_file

_OURS = (
    "infthor_eval.harness.nieh_task.process_results",
    "infthor_eval.harness.nieh_task.process_pair",
)
ProcessResults = Callable[[Doc, list[str]], Mapping[str, Any]]


@dataclass(frozen=True)
class Metrics:
    """The metrics of a task by name, in the order of tables.

    Attributes:
        process: the task's own function; None for our scorers.
        code: what tells these metrics from others of their names: the version of the strict
            scorer's rules, or name and digest of the function's source.
    """

    names: tuple[str, ...]
    process: ProcessResults | None = None
    code: Mapping[str, str] = field(default_factory=dict)

    def scores(
        self, task_samples: TaskSamples, sample: QuestionVariant, reply: str
    ) -> dict[str, float]:
        """Return the metrics of a reply."""
        if self.process is None:
            by_scorer = scores(reply, sample.question.answers)
            return {name: by_scorer[name] for name in self.names}
        with wrap_metric_errors(f"process_results fails on {sample.question.id}"):
            results = self.process(doc_of(task_samples, sample), [reply])
            return {name: require_number(name, results[name]) for name in self.names}


PUBLISHED = Metrics(SCORERS, code={"strict": STRICT_RULES})


def metrics_of(task: TaskFile) -> Metrics:
    """Return the metrics of a task file."""
    name = task.settings["process_results"]
    listed = task.settings.get("metric_list") or []
    if name in _OURS:
        # Those of pairs are of two samples, so no metrics of one: summaries have them anyway.
        listed = [
            it
            for it in listed
            if not isinstance(it, Mapping) or it.get("metric") not in PAIR_BOUNDS
        ]
    for entry in listed:
        _check(entry, f"{task.path}: metric_list: ")
    if name in _OURS:
        return _our_metrics([entry["metric"] for entry in listed], f"{task.path}: metric_list: ")
    if not listed:
        raise DataError(
            f"{task.path}: a task with its own process_results names its metrics under metric_list"
        )
    module, attribute = _import_function(task.path, name)
    source = {"process_results": name, "source": digest_of_file(Path(str(module.__file__)))}
    return Metrics(tuple(entry["metric"] for entry in listed), getattr(module, attribute), source)


def _our_metrics(listed: Sequence[str], where: str) -> Metrics:
    for name in listed:
        if name not in SCORERS:
            raise DataError(
                f"{where}{name} is none of our scorers, {', '.join(SCORERS)}; name its "
                "process_results too"
            )
    names = tuple(name for name in SCORERS if name in (listed or SCORERS))
    return replace(
        PUBLISHED,
        names=names,
        code={key: rules for key, rules in PUBLISHED.code.items() if key in names},
    )


def _check(entry: object, where: str) -> None:
    if not isinstance(entry, Mapping) or "metric" not in entry:
        raise DataError(f"{where}{entry!r} is not a mapping with the metric's name (metric: NAME)")
    if entry.get("aggregation", "mean") != "mean":
        raise DataError(
            f"{where}{entry['metric']} is not averaged (aggregation: mean); use lm-eval"
        )
    # Full marks, pairs of twins and effective lengths read a score as better when it is higher.
    if not entry.get("higher_is_better", True):
        raise DataError(f"{where}{entry['metric']} is better when lower; negate it, or use lm-eval")


def _import_function(task_file: Path, name: str) -> tuple[ModuleType, str]:
    """Import a module as lm-eval does: beside the file, else from the path; return its name too."""
    module, _, attribute = name.rpartition(".")
    beside = task_file.parent / f"{module.replace('.', '/')}.py"
    try:
        if beside.is_file():
            spec = importlib.util.spec_from_file_location(module, beside)
            assert spec is not None and spec.loader is not None  # a .py file has both
            imported = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(imported)
        else:
            imported = importlib.import_module(module)
        getattr(imported, attribute)
    except STOPS:
        raise
    except BaseException as error:  # a module may raise anything when it is imported
        reason = in_one_line(error)
        raise DataError(
            f"{task_file}: process_results {name} cannot be imported ({reason})"
        ) from error
    return imported, attribute
