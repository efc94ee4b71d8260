"""The config of a run: everything that can change a number. Its hash names the run's folder."""

import json
from collections.abc import Mapping
from typing import Any

import infthor_eval
from infthor_eval.runs.journals.records import P, RunHeader, U
from infthor_eval.runs.request import PreparedRun
from infthor_eval.runs.suite import Workload
from model_adapters import Subject, adapter_identity

__all__ = ["as_json_values", "header_of", "run_config"]


def header_of(run: PreparedRun[U, P], subject: Subject, workload: Workload[U]) -> RunHeader:
    """Return the header of a run's journal."""
    request = run.request
    suite = run.suite
    code = {} if request.model in suite.baselines else adapter_identity(request.model)
    tasks = request.tasks
    ours = {"suite_code": dict(request.suite_code)} if request.suite_code else {}
    model = {"name": subject.name, **subject.identity()}
    config = run_config(
        suite.name, model, code, {**ours, **workload.config}, tasks.limit, tasks.seed
    )
    return RunHeader(suite=suite.name, name=request.label, config=config, n_units=workload.n_units)


def run_config(
    suite: str,
    model: Mapping[str, Any],
    code: Mapping[str, Any],
    workload: Mapping[str, Any],
    limit: int | None = None,
    seed: int = 0,
) -> dict[str, Any]:
    """Return the config of a run as JSON values.

    Args:
        suite: name of the suite.
        model: name and identity of the evaluated model, policy or baseline.
        code: identity of a model adapter that is not this package's
            (`model_adapters.adapter_identity`).
        workload: config of the workload.
        limit: number of items of each task; None for all.
        seed: seed of the run.
    """
    return as_json_values(
        {
            "infthor_eval": infthor_eval.__version__,
            "suite": suite,
            "model": dict(model),
            "adapter": dict(code),
            "limit": limit,
            "seed": seed,
            **workload,
        }
    )


def as_json_values(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return a config as it is read back from a journal: tuples become lists, keys strings."""
    return dict(json.loads(json.dumps(config)))
