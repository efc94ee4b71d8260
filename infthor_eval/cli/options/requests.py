"""From what was typed to the runs that it asks for: one per model, suite, and value of an option that takes several."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.cli.options.suites import chosen_options
from infthor_eval.errors import UsageError
from infthor_eval.runs import Catalog, RunRequest, Suite, TaskRequest
from infthor_eval.suites import split_by_suite, suite_identity, suite_named
from infthor_eval.workers import WorkerSettings

__all__ = ["Asked", "requests_for"]


@dataclass(frozen=True)
class Asked:
    """What all runs of a command have in common; see the options of `run`.

    Attributes:
        tasks: names of tasks and groups.
        data: folder of the data set.
        limit: of items a task.
        seed: of the runs.
        output: results folder.
        fresh: start anew.
        recover: go on without bad lines.
        worker_settings: how many workers, and where.
        include: folders with further task files.
        suite_options: option names to values, of all suites; None where not given.
    """

    tasks: tuple[str, ...]
    data: Path | None
    output: Path
    limit: int | None = None
    seed: int = 0
    fresh: bool = False
    recover: bool = False
    worker_settings: WorkerSettings = field(default_factory=WorkerSettings)
    include: tuple[Path, ...] = ()
    suite_options: Mapping[str, Any] = field(default_factory=dict)


def requests_for(
    asked: Asked, model: str, model_options: Mapping[str, str], name: str | None = None
) -> list[tuple[RunRequest, Suite]]:
    """The runs of one model.

    Args:
        asked: what is asked.
        model: name of the model.
        model_options: its options as typed.
        name: what its runs are called; None takes the checkpoint's name, or the model's.

    Raises:
        UsageError: an unknown task, a name that is no folder's, or an option of a suite that is not asked.
        DataError: a task file is not what it should be.
    """
    if name is not None and not re.fullmatch(r"\w[\w.@+ -]*", name):
        raise UsageError(f"--name {name!r}: names a folder; use letters, digits, '.', '_', '-', '@', '+' and blanks")
    by_suite = split_by_suite(Catalog.installed(asked.include).expand(asked.tasks))
    requests = []
    for suite_name, tasks in by_suite.items():
        for options in chosen_options(suite_name, asked.suite_options, by_suite.keys()):
            request = RunRequest(
                model=model,
                tasks=TaskRequest(tasks, options, asked.data, asked.limit, asked.seed),
                # One suite's run is named as typed; where there are several, each by its own tasks.
                asked=asked.tasks if len(by_suite) == 1 else tuple(task.name for task in tasks),
                output=asked.output,
                model_options=model_options,
                name=name,
                fresh=asked.fresh,
                recover=asked.recover,
                worker_settings=asked.worker_settings,
                include=asked.include,
                suite_code=suite_identity(suite_name),
            )
            requests.append((request, suite_named(suite_name)))
    return requests
