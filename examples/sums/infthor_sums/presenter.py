"""The presenter: what people see of the suite on the page of `infthor-eval report`.

A suite without one gets `PlainPresenter` itself: its tables, and the fields of its records as
samples.
"""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from infthor_eval.report.figures.style import LEGEND, add_legend, inline_svg, looks_of
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import Description
from infthor_eval.report.web.sections import Chart
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord
from infthor_sums.suite import KINDS, Sum

__all__ = ["SumsPresenter"]


class SumsPresenter(PlainPresenter):
    """See `infthor_eval.report.presenter.Presenter`."""

    title = "Sums"
    measure = "right sums"
    target_label = "sum"
    main_metric = "right"

    def describe(self, record: UnitRecord[Sum]) -> Description:
        """See `Presenter.describe`."""
        payload = record.payload
        return Description(f"{payload.a} + {payload.b}", str(payload.a + payload.b), payload.kind)

    def reply(self, record: UnitRecord[Sum]) -> str:
        """See `Presenter.reply`."""
        return record.payload.reply or ""

    def details(self, record: UnitRecord[Sum]) -> Mapping[str, str]:
        """See `Presenter.details`: none, the description has it all."""
        return {}

    def charts(self, runs: Sequence[Run]) -> list[Chart]:
        """See `Presenter.charts`: right sums by kind, a chart per task."""
        tasks = dict.fromkeys(task for run in runs for task in run.summary.summary.tasks)
        return [
            _chart(task, [run for run in runs if task in run.summary.summary.tasks])
            for task in tasks
        ]


def _chart(task: str, runs: Sequence[Run]) -> Chart:
    looks = looks_of(run.label for run in runs)  # colours that the colour-blind can tell apart
    shares = {run.label: run.summary.summary.tasks[task] for run in runs}

    def draw() -> Figure:
        figure = Figure(figsize=(3.0 + LEGEND, 2.4), layout="constrained")
        axes = figure.subplots()
        width = 0.8 / len(runs)
        for number, (label, rates) in enumerate(shares.items()):
            places = [place + (number - (len(runs) - 1) / 2) * width for place in range(len(KINDS))]
            heights = [100 * rates[kind].mean if kind in rates else 0.0 for kind in KINDS]
            axes.bar(places, heights, width, color=looks[label].colour)
        axes.set_axisbelow(True)
        axes.set_xticks(range(len(KINDS)), KINDS)
        axes.set_ylim(0, 100)
        axes.set_ylabel("right (%)")
        add_legend(axes, list(looks.items()))
        return figure

    description = "; ".join(
        f"{label} {100 * rates['all'].mean:.1f} %" for label, rates in shares.items()
    )
    return Chart(f"{task}: right sums by kind", inline_svg(draw), description)
