"""Presenter of NIEH: questions with the clue frames that answer them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from infthor_eval.nieh.above_guessing import score_above_guessing
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import Description, Timelines
from infthor_eval.report.runs import ReportRun
from infthor_eval.report.suites.nieh_columns import NIEH_COLUMNS
from infthor_eval.report.web.sections import Chart
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.runs import UnitRecord

__all__ = ["NiehPresenter"]

Record = UnitRecord[NiehAnswer]


class NiehPresenter(PlainPresenter):
    """See `Presenter`."""

    title = "Questions"
    measure = "questions right"
    target_label = "gold answer"
    main_metric = "strict"
    compares_scorers = True
    columns = NIEH_COLUMNS

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """See `Presenter.is_share`: all of them, although the reference scorer can exceed 1."""
        return True

    def further_scores(self, record: Record) -> Mapping[str, float]:
        """See `Presenter.further_scores`: scores above guessing, of questions that guessing does not solve."""
        scores = {scorer: score_above_guessing(record.payload, scorer) for scorer in SCORERS}
        return {f"{scorer}, above guessing": score for scorer, score in scores.items() if score is not None}

    def charts(self, runs: Sequence[ReportRun]) -> list[Chart]:
        """See `Presenter.charts`."""
        from infthor_eval.report.suites.nieh_charts import nieh_charts

        return nieh_charts(runs)

    def describe(self, record: Record) -> Description:
        """See `Presenter.describe`."""
        payload = record.payload
        target = ", ".join(map(str, payload.answers))
        return Description(payload.question, target, payload.question_type or "untyped", payload.clue_column)

    def reply(self, record: Record) -> str:
        """See `Presenter.reply`."""
        return record.payload.reply or ""

    def details(self, record: Record) -> Mapping[str, str]:
        """See `Presenter.details`: what the model thought; the page shows the rest elsewhere."""
        thinking = record.payload.thinking
        return {} if thinking is None else {"thought": thinking}

    def timelines(self, runs: Sequence[ReportRun], data: Path | None, thumbnails: ThumbnailStore) -> Timelines:
        """See `Presenter.timelines`."""
        from infthor_eval.report.suites.nieh_frames import find_timelines

        return find_timelines(runs, data, thumbnails)
