"""Requests that lm-eval keeps of an earlier command (`--cache_requests`).

It looks them up by the name of the task, which says nothing of the data: the questions of another
set would be asked, and their replies scored with the answers of this one. So what was kept is
taken only where it is of the docs that this process has built.
"""

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from infthor_eval.harness.requests import Doc
from infthor_eval.storage.digests import canonical_json, digest

__all__ = ["as_dataset", "refuse_others"]

_SHARE = re.compile(r"rank(\d+)-world_size(\d+)")  # of one of several processes, in the name
_Docs = frozenset[tuple[int, str]]  # number and digest of each
_built: list[_Docs] = []


def as_dataset(docs: Sequence[Doc]) -> dict[str, Any]:
    """Return the docs of a task as lm-eval takes them."""
    from datasets import Dataset

    rows = Dataset.from_list(docs)
    _built.append(frozenset((number, _digest(row)) for number, row in enumerate(rows)))
    return {"test": rows}


def refuse_others() -> None:
    """Let lm-eval make requests anew where it has kept those of other docs."""
    import lm_eval.api.task as tasks

    if not isinstance(tasks.load_from_cache, partial):
        tasks.load_from_cache = partial(_load, tasks.load_from_cache)


def _load(load: Callable[..., Any], file_name: str, **options: Any) -> Any:
    """Return kept requests, a list of them for each doc; None for none."""
    kept = load(file_name=file_name, **options)
    asked = [(it.doc_id, it.doc) for of_doc in kept or () for it in of_doc]
    if not any(isinstance(doc, dict) and "suite" in doc for _, doc in asked):
        return kept  # of no task of ours
    share = _SHARE.search(file_name)
    rank, size = (int(share[1]), int(share[2])) if share else (0, 1)
    found = frozenset((number, _digest(doc)) for number, doc in asked)
    ours = (frozenset(it for it in docs if it[0] % size == rank) for docs in _built)
    return kept if found in ours else None


def _digest(doc: Doc) -> str:
    return digest(canonical_json(doc))
