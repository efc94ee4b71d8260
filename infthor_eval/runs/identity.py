"""A run's identity: everything that can change a number."""

import json
from collections.abc import Mapping
from typing import Any

import infthor_eval
from model_adapters import Subject

__all__ = ["identity_of"]


def identity_of(
    suite: str, subject: Subject, code: Mapping[str, Any], workload: Mapping[str, Any], limit: int | None, seed: int
) -> dict[str, Any]:
    """The identity, as JSON values.

    Args:
        suite: the kind of evaluation.
        subject: what is evaluated.
        code: of a model's adapter that is not this package's (`model_adapters.adapter_identity`).
        workload: what the suite's numbers depend on.
        limit: of items a task.
        seed: of the run.
    """
    identity = {
        "infthor_eval": infthor_eval.__version__,
        "suite": suite,
        "model": {"name": subject.name, **subject.identity()},
        "adapter": dict(code),
        "limit": limit,
        "seed": seed,
        **workload,
    }
    # As it is read back from the journal: tuples are lists, keys are strings.
    return dict(json.loads(json.dumps(identity)))
