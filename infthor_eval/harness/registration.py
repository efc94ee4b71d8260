"""Registers our model class with lm-eval unimported, and our tasks; tells these whether the class
is used."""

import sys
from pathlib import Path
from typing import Any

from infthor_eval.errors import InfthorError, UsageError
from infthor_eval.exports import LM_EVAL_MODEL as NAME
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.terminal import print_error

_TARGET = "infthor_eval.harness.model:InfthorLM"
_references = False


def register() -> None:
    """Register the class as a "module:Class" that lm-eval imports when a person asks for it.

    lm-eval's own script catches nothing: from here on our errors are one line under it as well.
    """
    import lm_eval.api.task
    import lm_eval.models  # before registering, or the built-in models vanish (0.4.13)
    from lm_eval.api.registry import model_registry

    if NAME not in model_registry:
        model_registry.register(NAME, target=_TARGET)
    sys.excepthook = lambda kind, error, trace: (
        print_error(str(error))
        if isinstance(error, InfthorError)
        else sys.__excepthook__(kind, error, trace)
    )
    lm_eval.api.task.load_from_cache = _refuse_kept


def _refuse_kept(*, cache: bool, **_: object) -> None:
    """Stand for lm-eval's reader of the requests that it keeps."""
    if cache:
        raise UsageError(
            "--cache_requests: lm-eval keeps requests by the name of their task, so that those of "
            "another set would be asked and scored by this one's answers; leave it out"
        )


def add_tasks() -> None:
    """Let lm-eval's command find this package's tasks as it finds its own, by their names."""
    import lm_eval.tasks

    own = lm_eval.tasks.TaskManager

    class WithOurs(own):  # type: ignore[misc, valid-type]
        """lm-eval's tasks, ours, and those of the folders that a person gives, which come last."""

        def __init__(
            self, *args: Any, include_path: str | Path | list[Any] | None = None, **options: Any
        ) -> None:
            given = include_path if isinstance(include_path, list | tuple) else [include_path]
            paths = [packaged_folder("tasks"), *filter(None, given)]
            super().__init__(*args, include_path=paths, **options)

    # Its command imports the name when it runs, and takes no further folder otherwise.
    lm_eval.tasks.TaskManager = WithOurs


def say_model_takes_references() -> None:
    """Record that our class is this process's model; lm-eval creates the model before the tasks."""
    global _references  # noqa: PLW0603 - lm-eval passes nothing from the model to the tasks
    _references = True


def model_takes_references() -> bool:
    """Return True if requests need no pixels: a decoded frame takes 270 KB in each request."""
    return _references
