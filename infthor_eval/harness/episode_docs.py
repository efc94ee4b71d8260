"""Docs of tasks whose requests are episodes in a simulator."""

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from infthor_eval.harness.requests import Doc
from infthor_eval.runs import TaskFile, TaskRequest


def settings_doc(suite: str, config: Mapping[str, Any], settings: type, options: type) -> Doc:
    """Return the common part of a task's docs: suite, settings, options and data folder, as JSON.

    Args:
        suite: name of the suite.
        config: settings of the task, and lm-eval's metadata: `data`, and options of the suite.
        settings: dataclass of the settings that `dataset_kwargs` can have.
        options: dataclass of the suite's options.
    """
    names = [setting.name for setting in fields(settings)]
    other_names = [option.name for option in fields(options) if option.name not in names]
    return {
        "suite": suite,
        "settings": json.dumps(
            {name: config[name] for name in names if config.get(name) is not None}
        ),
        "options": json.dumps({name: config[name] for name in other_names if name in config}),
        "data": str(config.get("data") or ""),
    }


def task_request(
    doc: Doc, task: str, options: type, generation_kwargs: Mapping[str, Any], seed: int
) -> TaskRequest[Any]:
    """Return a task's request to its suite, given any of its docs and the type of its options."""
    settings = {
        "dataset_kwargs": json.loads(doc["settings"]),
        "generation_kwargs": generation_kwargs,
    }
    file = TaskFile(task, doc["suite"], Path(task), settings)
    data = Path(doc["data"]) if doc["data"] else None
    return TaskRequest([file], options(**json.loads(doc["options"])), data, None, seed)
