"""The formats by the names of `export --format`.

To add a format that runs are exported in: a module in this package with `write`, its line here, its
row in `docs/exports.md`; how it comes back, in `infthor_eval/formats/replies/logs.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from infthor_eval.errors import UsageError
from infthor_eval.plugins import import_target

if TYPE_CHECKING:
    from infthor_eval.exports.request import ExportRequest, Written
    from infthor_eval.run import Run

_WRITERS = {
    "every-eval-ever": "infthor_eval.exports.every_eval_ever:write",
    "hf-eval-results": "infthor_eval.exports.hub_results:write",
    "inspect": "infthor_eval.exports.inspect_log:write",
    "lm-eval": "infthor_eval.exports.lm_eval_files:write",
}
FORMATS = tuple(_WRITERS)
# The options of `export` that change what a format has; it refuses the others.
_TAKES = {
    "every-eval-ever": (
        "data",
        "model_id",
        "organization",
        "relationship",
        "dataset",
        "source_url",
    ),
    "hf-eval-results": ("model_id", "dataset", "source_url"),
    "inspect": ("data", "frames", "model_id"),
    "lm-eval": (),
}


def find_writer(
    name: str, options: Collection[str]
) -> Callable[[Sequence[Run], ExportRequest], Written]:
    """Return what writes runs in a format.

    Args:
        name: name of the format, one of `FORMATS`.
        options: the fields of the request that are given.
    """
    for option in options:
        if option not in _TAKES[name]:
            takers = [other for other in FORMATS if option in _TAKES[other]]
            raise UsageError(
                f"--{option.replace('_', '-')}: has no place in {name}; leave it out (it is for "
                f"{', '.join(takers)})"
            )
    writer: Callable[[Sequence[Run], ExportRequest], Written]
    writer = import_target(_WRITERS[name])
    return writer
