"""Pictures of what agents and arms earned: the paper's Figures 6 and 7, and success by radius."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from matplotlib.figure import Figure

from infthor_eval.episodes.curves import RewardCurves
from infthor_eval.errors import InfthorError
from infthor_eval.manipulation.curves import arm_curves
from infthor_eval.manipulation.radii import success_by_radius
from infthor_eval.manipulation.recorded_runs import ArmRun, label_by_radius
from infthor_eval.plans.curves import plan_curves
from infthor_eval.plans.recorded_runs import PlansRun
from infthor_eval.report.curves import curves_table, one_panel
from infthor_eval.report.drawing import inline_svg
from infthor_eval.report.figures import curves_figure
from infthor_eval.report.radius_figure import radii_figure, radii_table
from infthor_eval.report.web.arm_samples import arm_run
from infthor_eval.report.web.plan_samples import plans_run
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.sections import Chart, Section
from infthor_eval.tables import Table

__all__ = ["arm_sections", "plan_sections"]


def plan_sections(runs: Sequence[ReportRun]) -> Iterator[Section]:
    """Reward of plans, a section per task that the runs share."""
    drawn = [plans_run(run) for run in runs]
    for task in _shared([list(run.tasks) for run in runs]):
        made = partial(_plan_curves, drawn, task)
        yield _section(f"rewards-{task}", f"{task}: reward over steps and context", made)


def arm_sections(runs: Sequence[ReportRun]) -> Iterator[Section]:
    """Reward of arms along trajectories, and success by radius where there are several."""
    drawn = [arm_run(run) for run in runs]
    yield _section("arm-rewards", "Reward of pick-ups and puts", lambda: _curves(arm_curves(label_by_radius(drawn))))
    if len({task.radius for run in drawn for task in run.config.tasks.values()}) < 2:
        return  # one radius is no curve
    models = [replace(it, label=run.model) for it, run in zip(drawn, runs, strict=True)]
    yield _section("arm-radius", "Success by the hand's radius", lambda: _radii(models))


def _shared(tasks: Sequence[Sequence[str]]) -> list[str]:
    return [name for name in tasks[0] if all(name in others for others in tasks)]


def _section(key: str, title: str, make: Callable[[], tuple[Callable[[], Figure], Table, str]]) -> Section:
    """A section with a figure and its table; with the reason where the runs cannot be drawn together."""
    try:
        figure, table, told = make()
        return Section(key, title, (Chart(title, inline_svg(figure), told),), (table,))
    except InfthorError as error:
        return Section(key, title, notes=(f"not drawn: {error}",))


def _plan_curves(runs: Sequence[PlansRun], task: str) -> tuple[Callable[[], Figure], Table, str]:
    return _curves(plan_curves(runs, task))


def _curves(curves: RewardCurves) -> tuple[Callable[[], Figure], Table, str]:
    ends = (f"{run.label} {run.curves[curves.main].end.mean:.1f}" for run in curves.runs if curves.main in run.curves)
    return lambda: curves_figure(curves, one_panel(curves)), curves_table(curves), "at the end: " + "; ".join(ends)


def _radii(runs: Sequence[ArmRun]) -> tuple[Callable[[], Figure], Table, str]:
    found = success_by_radius(runs)
    return lambda: radii_figure(found), radii_table(found), "the numbers are in the table"
