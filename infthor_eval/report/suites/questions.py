"""Presenter of every suite that is a `QuestionSuite` and brings none of its own."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.questions.suite import (
    Question,
    QuestionAnswer,
    QuestionSuite,
    QuestionSummary,
    digest_of_questions,
)
from infthor_eval.report.charts import Chart, class_series, counted_classes
from infthor_eval.report.descriptions import THOUGHT, Description
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import FindFrames, Timelines
from infthor_eval.report.web.samples import Timeline, TimelineFrame
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[QuestionAnswer]


class QuestionsPresenter(PlainPresenter):
    """See `PlainPresenter`: each question in words, and a chart of the scores by kind."""

    target_label = "gold answer"

    def measure_of(self, task: str, summary: QuestionSummary) -> str:
        """See `PlainPresenter.measure_of`: the scorer's name."""
        return summary.metric

    def bounds(self, metric: str) -> tuple[float, float]:
        """See `PlainPresenter.bounds`."""
        return 0.0, 1.0

    def describe(self, record: Record) -> Description:
        """See `PlainPresenter.describe`."""
        return Description(record.payload.question, record.payload.answer, record.payload.kind)

    def reply(self, record: Record) -> str:
        """See `PlainPresenter.reply`."""
        return record.payload.reply or ""

    def details(self, record: Record) -> Mapping[str, str]:
        """See `PlainPresenter.details`: the thoughts, the description has all else."""
        thinking = record.payload.thinking
        return {} if thinking is None else {THOUGHT: thinking}

    def charts(self, runs: Sequence[Run]) -> list[Chart]:
        """See `PlainPresenter.charts`: scores by kind, a chart for each task."""
        tasks = dict.fromkeys(task for run in runs for task in run.summary.summary.tasks)
        charts = []
        for task in tasks:
            with_task = [run for run in runs if task in run.summary.summary.tasks]
            charts.append(_chart(task, with_task))
        return charts

    def request_frames(self, run: Run, data: Path | None) -> FindFrames:
        """See `PlainPresenter.request_frames`."""
        questions = cache(lambda task: _questions(run, task))
        return lambda record: (
            questions(record.task)[record.id].frames if record.payload.n_pictures else ()
        )

    def timelines(
        self, runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore
    ) -> Timelines:
        """See `PlainPresenter.timelines`: the pictures of each question."""
        frames: dict[UnitKey, Sequence[FrameRef]] = {}
        notes: dict[str, None] = {}
        for run in runs:
            pictured = [record for record in run.records if record.payload.n_pictures]
            for task in dict.fromkeys(record.task for record in pictured):
                try:
                    questions = _questions(run, task)
                except DataError as error:
                    notes[f"{task}: no pictures are shown: {error}"] = None
                    continue
                of_task = (record for record in pictured if record.task == task)
                frames |= {record.key: questions[record.id].frames for record in of_task}
        thumbnails.add_all({str(it.path): it.load for shown in frames.values() for it in shown})
        by_unit = {
            key: Timeline(
                len(shown),
                tuple(
                    TimelineFrame(place, thumbnails.number(str(frame.path)))
                    for place, frame in enumerate(shown)
                ),
            )
            for key, shown in frames.items()
        }
        return Timelines(by_unit, list(notes))


def _questions(run: Run, task: str) -> dict[str, Question]:
    """Return the questions of a task as its run asked them, by id."""
    config = run.header.config.tasks[task]
    assert isinstance(run.suite, QuestionSuite)  # nobody else gets this presenter
    try:
        questions = run.suite.questions(config.dataset_kwargs)
    except InfthorError as error:
        raise DataError(str(error)) from error
    if digest_of_questions(questions) != config.data:
        raise DataError("the dataset has changed since the run; run it again")
    return {question.id: question for question in questions}


def _chart(task: str, runs: Sequence[Run]) -> Chart:
    summaries: list[QuestionSummary] = [run.summary.summary for run in runs]
    kinds = list(dict.fromkeys(kind for summary in summaries for kind in summary.tasks[task]))
    series = [
        class_series(run.label, place, kinds, summary.tasks[task])
        for place, (run, summary) in enumerate(zip(runs, summaries, strict=True))
    ]
    metric = ", ".join(dict.fromkeys(summary.metric for summary in summaries))
    return Chart(
        title=f"{task}: {metric} by kind",
        caption="Higher is better: a dot is a mean score with its 95 % interval.",
        axes=("kind", f"{metric} (%)"),
        series=series,
        classes=counted_classes(kinds, series),
    )
