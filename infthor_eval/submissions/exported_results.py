"""Means that exports say beside their samples, which nobody needs to read, and some people do.

| form | samples | file beside them |
|---|---|---|
| Every Eval Ever | `<name>_samples.jsonl` | `<name>.json`: `score_details.score` of each result |
| lm-eval | `samples_<task>_<time>.jsonl` | `results_<time>.json`: `results` by task |

A journal's own are `results.json` and `scores.jsonl`.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from infthor_eval.formats.reading import read_json
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.submissions.exported_scores import told_score

__all__ = ["read_exported_means"]

_HINT = "send the export as it was written"
_EVERY_EVAL_EVER = re.compile(r"(?P<name>.+)_samples\.jsonl")
_LM_EVAL = re.compile(r"samples_.+_(?P<time>\d{4}-\d\d-\d\dT.*)\.jsonl")

Means = dict[tuple[str, str], float]


def read_exported_means(samples: Path) -> Means:
    """Return the means by task and metric that the file beside a file of samples tells.

    Raises:
        DataError: it cannot be read.
    """
    if named := _EVERY_EVAL_EVER.fullmatch(samples.name):
        path = samples.with_name(f"{named['name']}.json")
        read = _every_eval_ever
    elif named := _LM_EVAL.fullmatch(samples.name):
        path = samples.with_name(f"results_{named['time']}.json")
        read = _lm_eval
    else:
        return {}
    document = read_json(path, _HINT) if path.is_file() else {}
    return dict(read(document)) if isinstance(document, Mapping) else {}


def _every_eval_ever(document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str], float]]:
    results = document.get("evaluation_results")
    for result in results if isinstance(results, list) else []:
        if not isinstance(result, Mapping):
            continue
        task, _, metric = str(result.get("evaluation_result_id")).rpartition("/")
        details = result.get("score_details")
        score = told_score(details.get("score") if isinstance(details, Mapping) else None)
        if metric in SCORERS and score is not None:
            yield (task, metric), score


def _lm_eval(document: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str], float]]:
    results = document.get("results")
    for task, values in results.items() if isinstance(results, Mapping) else ():
        for metric in SCORERS:
            told = values.get(f"{metric},none") if isinstance(values, Mapping) else None
            if (score := told_score(told)) is not None:
                yield (str(task), metric), score
