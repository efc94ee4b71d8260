"""infthor-eval: evaluation of multimodal models on long-horizon embodied tasks (∞-THOR)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import os
    from typing import Any

    from matplotlib.figure import Figure
    from pandas import DataFrame

__all__ = [
    "Evaluator",
    "__version__",
    "evaluate",
    "load_figure",
    "load_run",
    "load_runs",
    "load_sample",
]

__version__ = "0.1.0"


def load_run(folder: str | os.PathLike[str]) -> DataFrame:
    """Return the samples of a run, of any suite, as a data frame of pandas.

    Args:
        folder: folder of the run ("results/oracle/nieh_mini_gt-HASH"); the run may still be going
            on.

    Returns:
        A row per sample (a question, a plan, an episode of an arm). Numbers are numbers: scores (1
        is right, NaN does not count), seconds, tokens, clues. docs/formats.md lists the columns. A
        cell without a value is NaN.

    Raises:
        DataError: there is no journal in the folder, or one with a bad line, or of another format.
        UsageError: the suite of the run is not known here.
    """
    frame: DataFrame = _call("infthor_eval.report.sample_table:load_run", folder)
    return frame


def load_runs(*folders: str | os.PathLike[str]) -> DataFrame:
    """Return the runs in some folders as a data frame of pandas.

    Args:
        folders: folders of runs, or folders above them ("results").

    Returns:
        A row per run and task: run, suite and task; state, whole or incomplete; score, low and
        high, the primary metric with its 95 % interval, from 0 to 1, and n, the units in it;
        answered, failed and not_asked, units of the whole run; requests, tokens_read,
        tokens_cached, tokens_written and cost in US dollars, of the whole run; changed, in UTC; and
        its folder. A run that cannot be read is left out with a warning.

    Raises:
        DataError: there is no such folder, or it cannot be searched.
    """
    frame: DataFrame = _call("infthor_eval.report.run_table:load_runs", *folders)
    return frame


def load_sample(
    folder: str | os.PathLike[str], name: str, data: str | os.PathLike[str] | None = None
) -> Any:
    """Return a sample of a run, which a notebook shows with frames, request, reply and score.

    Args:
        folder: folder of the run.
        name: id of the sample (`load_run` has it in the column `id`); of several variants or
            repetitions the first, or the one whose whole key this is.
        data: folder of its data set, if the run does not name it.

    Returns:
        A `Sample` of `infthor_eval.report.sample`.

    Raises:
        DataError: the run cannot be read.
        UsageError: there is no such sample.
    """
    return _call("infthor_eval.report.sample:load_sample", folder, name, data)


def load_figure(
    *folders: str | os.PathLike[str],
    name: str,
    task: str | None = None,
    panels: str | os.PathLike[str] | None = None,
) -> Figure:
    """Return a figure of the report as one of matplotlib, to be changed or saved.

    Args:
        folders: folders of runs.
        name: name of the figure, as `infthor-eval report --figure NAME` takes it.
        task: task to draw; None for what the runs share.
        panels: YAML file with the runs of each panel; None draws all in one.

    Raises:
        UsageError: there is no such figure, or not of these runs.
        DataError: a run or the file of panels cannot be read.
    """
    figure: Figure = _call(
        "infthor_eval.report.named_figures:load_figure", folders, name, task, panels
    )
    return figure


def evaluate(model: Any, tasks: str | list[str], **options: Any) -> DataFrame:
    """Evaluate models on tasks as `infthor-eval --model MODEL --tasks TASKS` does, and continue a
    run that was stopped.

    Args:
        model: names of models with commas between them; or a model or policy that is an object,
            whose run begins anew and is kept only where `out` says.
        tasks: names of tasks, likewise or as a list.
        options: options of the command: `limit=20`, `data="my_set"`, `greedy=True`,
            `model_args={"pretrained": "PATH"}`.

    Returns:
        The runs, as `load_runs` does.

    Raises:
        UsageError: an option or a name is unknown, or a value is not valid.
        InfthorError: as the command would say in one line.
    """
    given = {"tasks": tasks, **options}
    frame: DataFrame = _call("infthor_eval.cli.evaluation:evaluate", model, given)
    return frame


def _call(target: str, *arguments: Any) -> Any:
    """Call what "module:name" names, by name as every module imports this one, and few need
    pandas."""
    from infthor_eval.plugins import import_target

    return import_target(target)(*arguments)


def __getattr__(name: str) -> Any:
    """Return `Evaluator`, which is imported when it is asked for."""
    if name != "Evaluator":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from infthor_eval.plugins import import_target

    return import_target("infthor_eval.cli.evaluation:Evaluator")
