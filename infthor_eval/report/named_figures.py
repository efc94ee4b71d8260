"""The figures of `report --figure`, by name: for the command, and for notebooks."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from infthor_eval.errors import UsageError
from infthor_eval.report.presenter import Figure, FigureRequest, FigureResult
from infthor_eval.run import Run, open_runs
from infthor_eval.suites import find_presenter, suite_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure


def build_figure(
    folders: Sequence[Path], name: str, request: FigureRequest, notify: Callable[[str], None]
) -> FigureResult:
    """Read runs and build a figure of them.

    Args:
        folders: folders of the runs.
        name: name of the figure.
        request: which task and panels.
        notify: called with each bad line of a journal.
    """
    owners = {suite: find_presenter(suite).figures for suite in suite_names()}
    if not any(name in figures for figures in owners.values()):
        known = [item for figures in owners.values() for item in figures.items()]
        abouts = sorted(f"{key} ({figure.about})" for key, figure in known)
        raise UsageError(
            f"--figure {name}: is none that can be drawn; there are {', '.join(abouts)}"
        )
    runs = open_runs(folders, notify)
    figure = _require_figure(runs, name, owners)
    if request.panels is not None and not figure.has_panels:
        raise UsageError(f"--panels: figure {name} has panels of its own; leave it out")
    return figure.build(runs, request)


def load_figure(
    folders: Sequence[str | os.PathLike[str]],
    name: str,
    task: str | None,
    panels: str | os.PathLike[str] | None,
) -> MatplotlibFigure:
    """See `infthor_eval.load_figure`."""
    from infthor_eval.report.figures import plot_in_style

    request = FigureRequest(task, None if panels is None else Path(panels))
    return plot_in_style(build_figure([*map(Path, folders)], name, request, warnings.warn).plot)


def _require_figure(
    runs: Sequence[Run], name: str, owners: Mapping[str, Mapping[str, Figure]]
) -> Figure:
    """Return the figure of a name; of different ones of two packages the first run decides."""
    first = runs[0].suite.name
    owner = first
    if name not in owners[first]:
        owner = next(suite for suite, figures in owners.items() if name in figures)
    for run in runs:
        if run.suite.name != owner:
            raise UsageError(
                f"{run.folder}: is a run of {run.suite.name}, and figure {name} is of {owner}; "
                "leave it out"
            )
    return owners[owner][name]
