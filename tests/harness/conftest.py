"""lm-eval's own command in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

# lm-eval reads all of its own thousands of task files at each start, 20 seconds: it looks for ours
# alone here, and for all of them where a test is about that.
_OWN_TASKS_ALONE = """
import lm_eval.tasks
class OwnTasksAlone(lm_eval.tasks.TaskManager):
    def __init__(self, *given, **named):
        super().__init__(*given, **{**named, "include_defaults": False})
lm_eval.tasks.TaskManager = OwnTasksAlone
"""
LM_EVAL = f"{_OWN_TASKS_ALONE}\nfrom lm_eval.__main__ import cli_evaluate; cli_evaluate()"
OURS_WITH_ALL_TASKS = "from infthor_eval.cli import main; main()"
OURS = f"{_OWN_TASKS_ALONE}\n{OURS_WITH_ALL_TASKS}"


@pytest.fixture
def start() -> Callable[..., str]:
    """Runs a command in a process of its own, which is to end with an exit code; gives what it says
    on standard error."""

    def start(program: str, *arguments: object, path: Sequence[Path] = (), code: int = 0) -> str:
        environment = {**os.environ, "HF_HUB_OFFLINE": "1"}
        environment["PYTHONPATH"] = os.pathsep.join(
            [*map(str, path), *filter(None, [os.environ.get("PYTHONPATH")])]
        )
        command = [sys.executable, "-c", program, *map(str, arguments)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == code, done.stderr[-3000:]
        return done.stderr

    return start


def read_samples(folder: Path) -> dict[str, list[dict]]:
    """The samples files of a folder, by task."""
    by_task = {}
    for path in sorted(folder.rglob("samples_*.jsonl")):
        task = path.name.removeprefix("samples_").rpartition("_")[0]
        by_task[task] = [json.loads(line) for line in path.read_text().splitlines()]
    return by_task
