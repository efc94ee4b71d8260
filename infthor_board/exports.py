"""Scores that exports say of their samples, which `import-replies` does not read: it scores anew.

| form | sample | score |
|---|---|---|
| Every Eval Ever | `question_id`, `variant`, `repeat` in `metadata` | `evaluation.score` |
| inspect_ai | the same, and `epoch` | `scores` by metric |
| lm-eval | `doc.question_id`, `doc.variant`; of one repetition | a key for each metric |

lm-eval has the task in the name of the file. Means are in a file beside the samples, which nobody
needs to read, and some people do:

| form | samples | file beside them |
|---|---|---|
| Every Eval Ever | `<name>_samples.jsonl` | `<name>.json`: `score_details.score` of each result |
| lm-eval | `samples_<task>_<time>.jsonl` | `results_<time>.json`: `results` by task |

A journal's own are `results.json` and `scores.jsonl`.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.formats.reading import json_lines_of, read_json
from infthor_eval.formats.replies.exported_samples import fields_of_metadata
from infthor_eval.formats.replies.inspect_logs import INSPECT_SUFFIX, inspect_documents
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.quantities import MOST
from infthor_eval.runs import UnitKey

_HINT = "give the samples of the run"
_HINT_ON_MEANS = "send the export as it was written"
_LM_EVAL_NAME = re.compile(r"samples_(?P<task>.+)_\d{4}-\d\d-\d\dT.*\.jsonl(?:\.gz)?")
_EVERY_EVAL_EVER_WITH_MEANS = re.compile(r"(?P<name>.+)_samples\.jsonl")
_LM_EVAL_WITH_MEANS = re.compile(r"samples_.+_(?P<time>\d{4}-\d\d-\d\dT.*)\.jsonl")
Means = dict[tuple[str, str], float]  # by task and metric
# task (empty if unknown), id of the question, variant, number of the repetition
_Unit = tuple[str, str, str, int]


@dataclass
class ExportedScores:
    """Scores of an export.

    Attributes:
        tasks: names of the tasks that it tells.
        models: names of models that it tells.
        by_unit: scores by task, question, variant and repetition, and by metric.
    """

    tasks: set[str] = field(default_factory=set)
    models: set[str] = field(default_factory=set)
    by_unit: dict[_Unit, dict[str, float]] = field(default_factory=dict)

    def of(self, task: str, unit: UnitKey) -> Mapping[str, float]:
        """Return the scores of a unit of a task, by the name that the file has for the task."""
        rest = unit.id, unit.variant, unit.repeat
        return self.by_unit.get((task, *rest)) or self.by_unit.get(("", *rest)) or {}

    def add(self, unit: _Unit, metric: str, score: object) -> None:
        """Add a score, if it is a number under one of our scorers."""
        stated = _stated_score(score)
        if metric in SCORERS and stated is not None:
            self.by_unit.setdefault(unit, {})[metric] = stated


def _stated_score(value: object) -> float | None:
    """Return a score that others state, None for what is no number; whatever no float holds, and
    what is none itself, is infinite, as it is the score of no reply."""
    if not isinstance(value, int | float):
        return None
    return float(value) if -MOST <= value <= MOST else math.inf


def read_exported_scores(path: Path) -> ExportedScores:
    """Read the scores that a file of samples tells; a form without scores tells none."""
    found = ExportedScores()
    if name := _LM_EVAL_NAME.fullmatch(path.name):
        found.tasks.add(name["task"])
    if path.suffix == INSPECT_SUFFIX:
        for sample in inspect_documents(path):
            _add(found, sample, _add_inspect)
        return found
    for row in json_lines_of(path, _HINT):
        if isinstance(row.get("doc"), Mapping):
            _add(found, row, _add_lm_eval)
        elif "evaluation_id" in row:
            _add(found, row, _add_every_eval_ever)
    return found


def _add(
    found: ExportedScores,
    row: Mapping[str, Any],
    add: Callable[[ExportedScores, Mapping[str, Any]], None],
) -> None:
    with suppress(ValueError):  # of a row that is no reply, either: it is named as such
        add(found, row)


def _mapping(value: object) -> Mapping[str, Any]:
    """Return a mapping, and an empty one for anything else: whoever reads replies says that."""
    return value if isinstance(value, Mapping) else {}


def _unit(metadata: Mapping[str, Any], sample_id: str) -> _Unit:
    fields = fields_of_metadata(metadata, sample_id)
    return fields["task"], fields["question_id"], fields["variant"], fields["repeat"]


def _add_every_eval_ever(found: ExportedScores, row: Mapping[str, Any]) -> None:
    metadata = _mapping(row.get("metadata"))
    if "members" in metadata:
        return
    unit = _unit(metadata, str(row.get("sample_id")))
    found.tasks |= {unit[0]} - {""}
    found.models.add(str(row.get("model_id")))
    metric = str(row.get("evaluation_result_id", "")).rpartition("/")[2]
    found.add(unit, metric, _mapping(row.get("evaluation")).get("score"))


def _add_inspect(found: ExportedScores, sample: Mapping[str, Any]) -> None:
    task, question, variant, _ = _unit(_mapping(sample.get("metadata")), str(sample.get("id")))
    epoch = sample.get("epoch", 1)
    if not isinstance(epoch, int):
        return
    found.tasks |= {task} - {""}
    found.models |= {str(_mapping(sample.get("output")).get("model") or "")} - {""}
    for metric, score in _mapping(sample.get("scores")).items():
        found.add((task, question, variant, epoch), metric, _mapping(score).get("value"))


def _add_lm_eval(found: ExportedScores, row: Mapping[str, Any]) -> None:
    doc = row["doc"]
    resps = row.get("resps")
    if isinstance(resps, list) and resps and isinstance(resps[0], list) and len(resps[0]) == 1:
        unit = "", str(doc.get("question_id")), str(doc.get("variant", "")), 1
        for metric in SCORERS:
            found.add(unit, metric, row.get(metric))


def read_exported_means(samples: Path) -> Means:
    """Return the means by task and metric that the file beside a file of samples tells."""
    if named := _EVERY_EVAL_EVER_WITH_MEANS.fullmatch(samples.name):
        path = samples.with_name(f"{named['name']}.json")
        read = _means_of_every_eval_ever
    elif named := _LM_EVAL_WITH_MEANS.fullmatch(samples.name):
        path = samples.with_name(f"results_{named['time']}.json")
        read = _means_of_lm_eval
    else:
        return {}
    document = read_json(path, _HINT_ON_MEANS) if path.is_file() else {}
    return dict(read(_mapping(document)))


def _means_of_every_eval_ever(
    document: Mapping[str, Any],
) -> Iterator[tuple[tuple[str, str], float]]:
    results = document.get("evaluation_results")
    for result in results if isinstance(results, list) else []:
        stated = _mapping(result)
        task, _, metric = str(stated.get("evaluation_result_id")).rpartition("/")
        score = _stated_score(_mapping(stated.get("score_details")).get("score"))
        if metric in SCORERS and score is not None:
            yield (task, metric), score


def _means_of_lm_eval(document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str], float]]:
    for task, values in _mapping(document.get("results")).items():
        for metric in SCORERS:
            score = _stated_score(_mapping(values).get(f"{metric},none"))
            if score is not None:
                yield (str(task), metric), score
