"""What the docs of tasks have in common whose requests are episodes in a simulator."""

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

__all__ = ["about_run"]


def about_run(config: Mapping[str, Any], settings: type, options: type) -> dict[str, str]:
    """What each doc carries along of the run: settings and options as JSON, and where the data are.

    Args:
        config: a task's settings, and of what lm-eval hands over as metadata: `data`, and the suite's options.
        settings: dataclass of what `dataset_kwargs` can say.
        options: dataclass of the suite's options.
    """
    names = [item.name for item in fields(settings)]
    more = [item.name for item in fields(options) if item.name not in names]
    return {
        "settings": json.dumps({name: config[name] for name in names if config.get(name) is not None}),
        "options": json.dumps({name: config[name] for name in more if name in config}),
        "data": str(config.get("data") or ""),
    }
