"""`evaluate` and `Evaluator`, for notebooks and training: what the command does, without its
process."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.errors import ModelError, UsageError

if TYPE_CHECKING:
    from pandas import DataFrame

    from infthor_eval.runs import PreparedRun, RunOutcome
    from model_adapters import FramePolicy, Model, Policy

# A model that every suite takes until it is loaded, which it is not.
_PLACEHOLDER = "openvla-tiny"


class Evaluator:
    """Evaluates models that are objects on the same tasks again and again, as in training; a
    context manager.

    Data are read once, and simulators stay open between the calls.

    Args:
        tasks: names of tasks with commas between them, or a list.
        options: options of the command: `limit=20`, `data="my_set"`; `out` keeps the runs.
    """

    def __init__(self, tasks: str | Sequence[str], **options: Any) -> None:
        if "model" in options:
            raise UsageError("model: an Evaluator is called with the model; leave it out")
        self._options = {**options, "tasks": tasks, "model": _PLACEHOLDER}
        self._stack = ExitStack()
        self._runs: list[PreparedRun] = []

    def __enter__(self) -> Evaluator:
        from infthor_eval.storage.scratch import ScratchFolder

        options = self._options
        if "out" not in options:
            options = {**options, "out": str(self._stack.enter_context(ScratchFolder()))}
        self._runs = _prepare(options)
        for run in self._runs:
            keep = getattr(run.evaluation, "keeping_simulators", None)
            if keep is not None:
                self._stack.enter_context(keep())
        return self

    def __exit__(self, *_: object) -> None:
        self._runs = []
        self._stack.close()

    def __call__(self, model: Model | Policy | FramePolicy, name: str = "") -> dict[str, float]:
        """Return the primary score of each task, 0 to 1 (net pairs -1 to 1).

        Args:
            model: the model or policy; it is not closed.
            name: name of the run, such as that of the training's step; the model's where empty. An
                earlier run of the name is kept beside it.

        Raises:
            InfthorError: as the command would say in one line; no unit has a result.

        Warns:
            UserWarning: some units failed, which the scores leave out.
        """
        scores: dict[str, float] = {}
        for outcome in self.outcomes(model, name):
            _tell_failures(outcome)
            found = outcome.run.suite.primary_metrics(outcome.summary.summary)
            scores |= {task: rate.mean for task, rate in found.items()}
        return scores

    def outcomes(self, model: Model | Policy | FramePolicy, name: str = "") -> list[RunOutcome]:
        """Return the runs of a model; see `__call__`."""
        from infthor_eval.exports.lm_eval import export
        from infthor_eval.runs import execute
        from infthor_eval.runs.request import IN_MEMORY
        from model_adapters.guarded import guard

        if not self._runs:
            raise UsageError("an Evaluator is used in a block: with Evaluator(...) as evaluator")
        if isinstance(model, str):
            raise UsageError(f"{model}: give an object; infthor_eval.evaluate takes names")
        model = guard(getattr(model, "name", "(in memory)"), model)
        outcomes = []
        for run in self._runs:
            request = replace(run.request, model=IN_MEMORY, name=name or model.name, fresh=True)
            outcomes.append(execute(replace(run, request=request), loaded=model))
            export(outcomes[-1])
        return outcomes


def _tell_failures(outcome: RunOutcome) -> None:
    failures = [record.failure for record in outcome.records if record.failure]
    if failures and len(failures) == len(outcome.records):
        raise ModelError(f"all {len(failures)} units failed: {failures[0]}")
    if failures:
        text = f"{len(failures)} of {len(outcome.records)} units failed: {failures[0]}"
        warnings.warn(text, stacklevel=3)


def evaluate(model: Any, options: Mapping[str, Any]) -> DataFrame:
    """See `infthor_eval.evaluate`; the options are taken as those of `--config` are."""
    from infthor_eval.cli.progress.runs import execute_runs
    from infthor_eval.exports.lm_eval import export
    from infthor_eval.report.run_table import load_runs

    if not isinstance(model, str):
        with Evaluator(**options) as evaluator:
            return load_runs(*(outcome.folder for outcome in evaluator.outcomes(model)))
    outcomes, is_stopped = execute_runs(_prepare({"model": model, **options}), finish=export)
    if is_stopped:
        raise KeyboardInterrupt
    return load_runs(*(outcome.folder for outcome in outcomes))


def _prepare(options: Mapping[str, Any]) -> list[PreparedRun]:
    """Prepare the runs that the command would do with these options."""
    from infthor_eval.cli.commands.run import command
    from infthor_eval.cli.options.config import take_options
    from infthor_eval.cli.options.run import RunOptions
    from infthor_eval.cli.progress.undrawn import draw_missing
    from infthor_eval.runs import prepare_all

    try:
        context = click.Context(command, info_name="evaluate")
        take_options(context, options, "evaluate")
        with context.scope(cleanup=False):
            command.parse_args(context, [])
            requests = RunOptions.from_click(context.params).requests()
    except click.ClickException as error:
        raise UsageError(error.format_message()) from error
    draw_missing(requests)
    return prepare_all(requests)
