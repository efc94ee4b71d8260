"""Prepared runs on trajectories that are cut down."""

from collections.abc import Callable
from typing import Any

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.runs import PreparedRun, prepare

_OF_RUNS = ("tasks", "data", "output", "seed", "limit", "fresh", "recover")


def make_preparer(default_model: str, **defaults: Any) -> Callable[..., PreparedRun]:
    """Return a function that prepares a run.

    Its keyword arguments are the model, its options, those of `RunOptions`, which have these
    defaults, and the suite's.
    """

    def make(
        model: str = default_model, model_options: dict[str, str] | None = None, **changes: Any
    ) -> PreparedRun:
        settings = {**defaults, **{name: changes.pop(name) for name in _OF_RUNS if name in changes}}
        models = (ModelSpec(model, model_options or {}),)
        ((request, suite),) = RunOptions(models, **settings, suite_options=changes).requests()
        return prepare(request, suite)

    return make
