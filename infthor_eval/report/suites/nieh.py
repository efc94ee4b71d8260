"""Presenter of NIEH: questions with the clue frames that answer them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean

from infthor_eval.distances import age_class
from infthor_eval.nieh.records import BlindGuess, NiehAnswer
from infthor_eval.nieh.rescoring.judging import JUDGED
from infthor_eval.nieh.results.above_blind import score_above_blind, score_range
from infthor_eval.nieh.results.facets import FACETS
from infthor_eval.nieh.results.pair_summary import score_pairs
from infthor_eval.nieh.results.pair_tables import pair_tables
from infthor_eval.nieh.results.summary import NiehSummary, main_metric
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.pairs import PAIR_BOUNDS
from infthor_eval.report.charts import Chart
from infthor_eval.report.descriptions import THOUGHT, Description
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.presenter import (
    Figure,
    FindFrames,
    GroupScore,
    ReplyTokens,
    Timelines,
)
from infthor_eval.report.suites.nieh_columns import NIEH_COLUMNS
from infthor_eval.report.suites.pair_charts import build_pairs_figure, memory_curves
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]
_ABOVE_BLIND = ", above blind"
_AT_AGE = ", age "
_BOUNDS = {
    "strict": (0.0, 1.0),
    "reference": (0.0, math.inf),
    JUDGED: (0.0, 1.0),
    **PAIR_BOUNDS,
}


class NiehPresenter(PlainPresenter):
    """See `PlainPresenter`."""

    title = "Questions"
    measure = "questions right"
    finding = "gets {} of the questions right"
    target_label = "gold answer"
    member_label = "world"
    main_metric = "strict"
    compares_scorers = True
    columns = NIEH_COLUMNS
    figures: Mapping[str, Figure] = {
        "pairs": Figure(
            "net pairs of twins by distance, frames shown and age", build_pairs_figure, False
        )
    }

    def has_pairs(self, task: str, summary: NiehSummary) -> bool:
        """See `PlainPresenter.has_pairs`."""
        return summary.tasks[task].pairs is not None

    def chance(self, task: str, summary: NiehSummary, records: Sequence[Record]) -> float | None:
        """See `PlainPresenter.chance`: of questions that of `blind`; who does not know which world
        of a pair is which has 0 net pairs on average."""
        of_task = summary.tasks[task]
        if of_task.pairs is not None:
            return 0.0
        metric = main_metric(of_task)
        scores = [
            None if record.payload.blind is None else record.payload.blind.scores.get(metric)
            for record in records
            if record.state == "answered"
        ]
        known = [score for score in scores if score is not None]
        return fmean(known) if known and len(known) == len(scores) else None

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """See `PlainPresenter.is_share`: all are, although the reference scorer can exceed 1."""
        return True

    def bounds(self, metric: str) -> tuple[float, float]:
        """See `PlainPresenter.bounds`: the reference scorer exceeds 1 on repetitions; scores above
        `blind`, of a part of a set, can be anything, and so can a task's own metrics."""
        return _BOUNDS.get(metric.partition(_AT_AGE)[0], (-math.inf, math.inf))

    def extra_scores(self, record: Record) -> Mapping[str, float]:
        """See `PlainPresenter.extra_scores`: scores above `blind` where that does not solve all."""
        scores = {scorer: score_above_blind(record.payload, scorer) for scorer in SCORERS}
        return {
            f"{scorer}{_ABOVE_BLIND}": score
            for scorer, score in scores.items()
            if score is not None
        }

    def extra_ranges(self, record: Record) -> Mapping[str, tuple[float, float]]:
        """See `PlainPresenter.extra_ranges`."""
        counted = [
            scorer for scorer in SCORERS if f"{scorer}{_ABOVE_BLIND}" in self.extra_scores(record)
        ]
        return {f"{scorer}{_ABOVE_BLIND}": score_range([record], scorer) for scorer in counted}

    def explain(self, record: Record) -> list[str]:
        """See `PlainPresenter.explain`: what each of our scorers finds in the reply."""
        from infthor_eval.nieh.explaining import explain

        if record.payload.reply is None:
            return []
        scorers = [scorer for scorer in SCORERS if scorer in record.payload.scores]
        return explain(record.payload.reply, record.payload.answers, scorers)

    def group(self, record: Record) -> str:
        """See `PlainPresenter.group`: the pair of a question of twins."""
        twin = record.payload.twin
        return "" if twin is None else twin.pair

    def group_scores(self, records: Sequence[Record]) -> Iterator[GroupScore]:
        """See `PlainPresenter.group_scores`: net pairs of twins, at moments also of each age."""
        ages = {
            record.payload.twin.pair: age_class(record.payload.twin.age)
            for record in records
            if record.payload.moment is not None
            and record.payload.twin is not None
            and record.payload.twin.age is not None
        }
        metrics = dict.fromkeys(name for record in records for name in record.payload.scores)
        metric = self.main_metric if self.main_metric in metrics else next(iter(metrics), "")
        for pair in score_pairs(records, metric):
            group = " ".join(filter(None, (pair.pair, pair.variant)))
            for name, score in pair.shares.by_metric.items():
                yield GroupScore(name, group, pair.cluster, score)
            if pair.pair in ages:
                name = f"net_pairs{_AT_AGE}{ages[pair.pair]}"
                yield GroupScore(name, group, pair.cluster, pair.shares.net)

    def opening(self, runs: Sequence[Run]) -> Section | None:
        """See `PlainPresenter.opening`: pairs of twins, if there are any."""
        tables = pair_tables([run.summary for run in runs])
        if not tables:
            return None
        return Section("pairs", "Pairs of twins", memory_curves(runs), tuple(tables))

    def charts(self, runs: Sequence[Run]) -> list[Chart]:
        """See `PlainPresenter.charts`."""
        from infthor_eval.report.suites.nieh_charts import nieh_charts

        return nieh_charts(runs)

    def describe(self, record: Record) -> Description:
        """See `PlainPresenter.describe`."""
        payload = record.payload
        target = ", ".join(map(str, payload.answers))
        return Description(
            payload.question, target, payload.question_type or "untyped", payload.clue_column
        )

    def reply(self, record: Record) -> str:
        """See `PlainPresenter.reply`."""
        return record.payload.reply or ""

    def reply_tokens(self, record: Record) -> ReplyTokens | None:
        """See `PlainPresenter.reply_tokens`."""
        payload = record.payload
        return ReplyTokens(payload.reply_ids, payload.margins) if payload.margins else None

    def details(self, record: Record) -> Mapping[str, str]:
        """See `PlainPresenter.details`: evidence, `blind` and thoughts; the rest is elsewhere."""
        payload = record.payload
        details: dict[str, str] = {}
        if payload.moment is not None:
            details["asked after frame"] = str(payload.moment)
        if payload.shown_clues is not None:
            details["clue frames shown"] = (
                f"{payload.shown_clues.n_shown} of {payload.shown_clues.n_clues}"
            )
        if payload.blind is not None:
            details["blind"] = _blind(payload.blind)
            details |= {name: f"{score:+.2f}" for name, score in self.extra_scores(record).items()}
        for facet in FACETS:
            told = None if facet.has_column else facet.class_of(record)
            details |= {} if told is None else {facet.heading: told}
        if payload.thinking is not None:
            details[THOUGHT] = payload.thinking
        return details

    def recalled(self, record: Record) -> Sequence[int | str]:
        """See `PlainPresenter.recalled`."""
        recall = record.payload.recall
        return () if recall is None else recall.recalled

    def request_frames(self, run: Run, data: Path | None) -> FindFrames:
        """See `PlainPresenter.request_frames`."""
        from infthor_eval.report.suites.nieh_frames import RequestFrames

        return RequestFrames(run, data)

    def timelines(
        self, runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore
    ) -> Timelines:
        """See `PlainPresenter.timelines`."""
        from infthor_eval.report.suites.nieh_frames import find_timelines

        return find_timelines(runs, data, thumbnails)


def _blind(blind: BlindGuess) -> str:
    """Return what `blind` says to a question and scores in its form, in words."""
    means = blind.form_scores.items()
    scores = [f"{name} {blind.scores[name]:.2f}, in its form {mean:.2f}" for name, mean in means]
    return f'"{blind.reply}": {"; ".join(scores)} ({blind.form})'
