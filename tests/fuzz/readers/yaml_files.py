"""YAML files: tasks, recipes, panels of figures, published tables, options of a command. JSON is
YAML, too."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import click

from infthor_eval.cli.commands.run import command as run_command
from infthor_eval.episodes.curves import Curve, Facet, RewardCurves, RunCurves
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.report.suites.reward_curves import read_panels
from infthor_eval.runs.catalog import Catalog
from infthor_eval.statistics import MeanEstimate
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.suites import find_suite
from infthor_eval.training.recipe import read_recipe

from ..damage import Form
from ..reader import Reader

__all__ = ["READERS"]

_TASKS = ("nieh/contexts/nieh_truncate_head_8k", "nieh/nieh_mini_memory",
          "plans/infthor_plans_mini",
          "plans/infthor_final_mini", "manipulation/manipulathor_put_mini")  # fmt: skip
_OPTIONS = {
    "model": "oracle", "tasks": ["nieh_gt"], "limit": 3, "seed": 1,
    "model_args": {"a": 1, "b": "c"}, "fresh": False,
    "budget": 100, "repeats": 2, "temperature": 0.5, "workers": 1, "name": "x",
}  # fmt: skip


def _make(name: str, document: Any, folder: Path) -> Path:
    (folder / name).write_text(json.dumps(document))
    return folder / name


def _make_recipe(name: str, folder: Path) -> Path:
    return _make(
        "a.yaml", read_yaml(packaged_folder("training/recipes") / f"{name}.yaml", ""), folder
    )


def _make_task(name: str, folder: Path) -> Path:
    settings = read_yaml(packaged_folder("tasks") / f"{name}.yaml", "")
    more = {
        "generation_kwargs": {
            "max_gen_toks": 16,
            "until": ["\n"],
            "do_sample": False,
            "temperature": 0.0,
        }
    }
    return _make(
        "a.yaml",
        more | settings | {"task": "mine", "include": settings["include"].rpartition("/")[2]},
        folder,
    )


_TASK = """# mine
include: _nieh.yaml
task: mine
dataset_kwargs: &settings
  context: truncate_head
  ctx_size: 8
  seed: 0
"""


def _make_task_text(folder: Path) -> Path:
    """Write a task as people write it, with a comment and an anchor."""
    (folder / "a.yaml").write_text(_TASK)
    return folder / "a.yaml"


def _check_task(folder: Path) -> None:
    for task in Catalog(packaged_folder("tasks"), (folder,)).expand(["mine"]):
        find_suite(task.suite).check_task(task)


def _parse_options(folder: Path) -> None:
    try:
        run_command.make_context("run", ["--config", str(folder / "a.yaml")]).close()
    except click.ClickException as error:
        assert "\n" not in error.message


_CURVE = Curve((0.0, 10.0), (MeanEstimate(0.5, 0.1, 0.3, 0.7, 4, 2),) * 2)
_CURVES = RewardCurves(
    task="infthor_plans",
    facets={"steps": Facet("steps")},
    runs=tuple(RunCurves(label, False, True, {"steps": _CURVE}, {}) for label in ("A", "B")),
    n_trajectories=1,
    notes=(),
)
_PANELS = {"one": ["A", "B"], "two": ["A"]}
READERS = (
    *(
        Reader(
            f"task file {name.rpartition('/')[2]}",
            Form.JSON,
            partial(_make_task, name),
            _check_task,
        )
        for name in _TASKS
    ),
    Reader("task file, as text", Form.TEXT, _make_task_text, _check_task),
    *(
        Reader(
            f"recipe {name}",
            Form.JSON,
            partial(_make_recipe, name),
            lambda folder: read_recipe(str(folder / "a.yaml")),
        )
        for name in ("infthor_32k", "questions")
    ),
    Reader(
        "panels",
        Form.JSON,
        partial(_make, "a.yaml", _PANELS),
        lambda folder: read_panels(folder / "a.yaml", _CURVES),
    ),
    Reader("options of a command", Form.JSON, partial(_make, "a.yaml", _OPTIONS), _parse_options),
)
