"""A run's identity: everything that can change a number."""

import json
from collections.abc import Mapping
from typing import Any

import infthor_eval
from infthor_eval.formats.digests import fingerprint
from infthor_eval.runs.records import RunHeader
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.suite import Workload
from model_adapters import Subject, adapter_identity

__all__ = ["episode_fingerprint", "header_of", "identity_of"]

_OF_ALL_TRAJECTORIES = ("trajectories", "broken")


def header_of(run: PreparedRun, subject: Subject, workload: Workload) -> RunHeader:
    """Who a run is, once its subject is loaded and its work is found."""
    request, suite = run.request, run.suite
    code = {} if request.model in suite.baselines else adapter_identity(request.model)
    tasks = request.tasks
    ours = {"suite_code": dict(request.suite_code)} if request.suite_code else {}
    identity = identity_of(suite.name, subject, code, {**ours, **workload.identity}, tasks.limit, tasks.seed)
    return RunHeader(suite=suite.name, name=request.label, identity=identity)


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


def episode_fingerprint(identity: Mapping[str, Any], task: str, **inputs: Any) -> str:
    """Hash of all that a unit in a simulator depends on.

    Args:
        identity: of the workload; of its tasks only what holds for each trajectory counts.
        task: the unit's.
        inputs: the unit's own: its trajectory, its place there, the seed.
    """
    every = {name: value for name, value in identity.items() if name != "tasks"}
    settings = {name: value for name, value in identity["tasks"][task].items() if name not in _OF_ALL_TRAJECTORIES}
    return fingerprint({"task": settings, **every, **inputs})
