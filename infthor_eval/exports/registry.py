"""The formats by the names of `export --format`.

To add a format that runs are exported in: a module in this package with `write`, its line here, its
rows in `docs/exports.md`; what it gives back, in `infthor_eval/formats/replies/logs.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from infthor_eval.errors import unknown_name
from infthor_eval.plugins import import_target

if TYPE_CHECKING:
    from infthor_eval.exports.request import ExportRequest, Written
    from infthor_eval.report.presented import PresentedRun

__all__ = ["FORMATS", "find_writer"]

_WRITERS = {
    "every-eval-ever": "infthor_eval.exports.every_eval_ever:write",
    "hf-eval-results": "infthor_eval.exports.hub_results:write",
    "inspect": "infthor_eval.exports.inspect_log:write",
    "lm-eval": "infthor_eval.exports.lm_eval:write",
}
FORMATS = tuple(_WRITERS)


def find_writer(name: str) -> Callable[[Sequence[PresentedRun], ExportRequest], Written]:
    """Return what writes runs in a format.

    Raises:
        UsageError: there is no such format.
    """
    if name not in _WRITERS:
        raise unknown_name("format", name, FORMATS)
    writer: Callable[[Sequence[PresentedRun], ExportRequest], Written]
    writer = import_target(_WRITERS[name])
    return writer
