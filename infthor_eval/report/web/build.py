"""From runs to the page: which sections there are, and which samples."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import infthor_eval
from infthor_eval.errors import DataError
from infthor_eval.report.comparison import compare, comparison_table
from infthor_eval.report.web.arm_samples import ERRANDS
from infthor_eval.report.web.episode_charts import arm_sections, plan_sections
from infthor_eval.report.web.episode_samples import Opener, episode_samples
from infthor_eval.report.web.nieh_charts import nieh_charts
from infthor_eval.report.web.nieh_samples import nieh_samples
from infthor_eval.report.web.page import About, Page
from infthor_eval.report.web.plan_samples import PLANS
from infthor_eval.report.web.primary_metrics import left_out_table, primary_metrics_table, took_table
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.samples import Sample
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import Thumbnails

__all__ = ["Wanted", "build_page"]

_TITLES = {"nieh": "Questions", "plans": "Plans", "manipulation": "Pick-ups and puts"}
_FEW = 4  # runs of which each is compared with each
_MAIN_METRIC = "strict"  # stands first among the scorers of samples


@dataclass(frozen=True)
class Wanted:
    """What the page is to hold.

    Attributes:
        data: folder of the questions' set, or of the trajectories, where runs do not tell; None asks them.
        stages: on which episodes are carried out again, by suite; of another suite nothing is shown that was seen.
        episodes: of each run that are carried out again.
        pictures: bytes of all pictures together.
    """

    data: Path | None = None
    stages: Mapping[str, Opener] = field(default_factory=dict)
    episodes: int = 12
    pictures: int = 15_000_000


def build_page(runs: Sequence[ReportRun], wanted: Wanted) -> Page:
    """The page of some runs, of one suite or of several.

    Raises:
        DataError: an identity is not that of a run of its suite.
    """
    suites: dict[str, list[ReportRun]] = {}
    for run in runs:
        suites.setdefault(run.suite.name, []).append(run)
    sections = [Section("results", "Results", tables=(primary_metrics_table(runs),))]
    for name, same in suites.items():
        sections += _suite_sections(name, same)
    sections += _comparisons(suites.values())
    sections.append(Section("cost", "Speed and cost", tables=(took_table(runs),)))
    left_out = left_out_table(runs)
    if left_out is not None:
        sections.append(Section("left-out", "Failed, skipped, left out", tables=(left_out,)))
    thumbnails = Thumbnails(wanted.pictures)
    samples, notes = _samples(runs, suites, wanted, thumbnails)
    return Page(
        title=_title(runs),
        version=infthor_eval.__version__,
        runs=[_about(run) for run in runs],
        sections=[section for section in sections if not section.is_empty],
        samples=samples,
        metrics=_metrics(samples),
        pictures=thumbnails.encoded,
        notes=notes,
    )


def _title(runs: Sequence[ReportRun]) -> str:
    named = ", ".join(run.label for run in runs)
    return named if len(named) <= 60 else f"{len(runs)} runs"


def _suite_sections(name: str, runs: Sequence[ReportRun]) -> Iterator[Section]:
    charts = nieh_charts(runs) if name == "nieh" else []
    tables = runs[0].suite.tables([run.summary for run in runs])
    yield Section(name, _TITLES.get(name, name), tuple(charts), tuple(tables))
    if name == "plans":
        yield from plan_sections(runs)
    if name == "manipulation":
        yield from arm_sections(runs)


def _comparisons(suites: Iterable[Sequence[ReportRun]]) -> Iterator[Section]:
    """Each run against each before it, of its suite; of many, each against the first."""
    tables, notes = [], []
    for runs in suites:
        pairs = combinations(runs, 2) if len(runs) <= _FEW else ((runs[0], other) for other in runs[1:])
        for first, second in pairs:
            try:
                rows = compare(first.suite, first.records, second.records)
            except DataError as error:
                notes.append(f"{second.label} against {first.label}: {error}")
                continue
            tables.append(comparison_table(rows, first.label, second.label))
        if len(runs) > _FEW:
            notes.append(f"each run against {runs[0].label}; infthor-eval compare tells of any two")
    if tables or notes:
        yield Section("comparison", "Comparison", (), tuple(tables), tuple(notes))


def _samples(
    runs: Sequence[ReportRun], suites: dict[str, list[ReportRun]], wanted: Wanted, thumbnails: Thumbnails
) -> tuple[list[Sample], list[str]]:
    """Of all suites; a sample has a place for the result of every run of the page."""
    samples: list[Sample] = []
    notes: list[str] = []
    for name, same in suites.items():
        found, told = _samples_of(name, same, wanted, thumbnails)
        places = [runs.index(run) for run in same]
        samples += [sample.among(len(runs), places) for sample in found]
        notes += told
    if thumbnails.n_left_out:
        notes.append(f"{thumbnails.n_left_out:,} pictures left out, to keep the page small")
    return samples, notes


def _samples_of(
    suite: str, runs: Sequence[ReportRun], wanted: Wanted, thumbnails: Thumbnails
) -> tuple[list[Sample], list[str]]:
    if suite == "nieh":
        return nieh_samples(runs, wanted.data, thumbnails)
    kind = {"plans": PLANS, "manipulation": ERRANDS}.get(suite)
    if kind is None:  # of another package
        return [], [f"samples of {suite} are not shown: how is not known here"]
    return episode_samples(runs, kind, wanted.stages.get(suite), wanted.data, wanted.episodes, thumbnails)


def _metrics(samples: Sequence[Sample]) -> list[str]:
    names = dict.fromkeys(
        name for sample in samples for result in sample.results if result is not None for name in result.scores
    )
    return sorted(names, key=lambda name: name != _MAIN_METRIC)


def _about(run: ReportRun) -> About:
    identity = run.header.config
    simulators = {about.get("simulator") for about in run.tasks.values() if isinstance(about, dict)}
    facts = {
        "suite": run.suite.name,
        "model": str(identity["model"].get("name", "")),
        "checkpoint": str(identity["model"].get("checkpoint", "")),
        "tasks": ", ".join(run.tasks),
        "simulator": str(identity.get("simulator", "") or ", ".join(sorted(filter(None, simulators)))),
        "seed": str(identity.get("seed", "")),
        "limit": str(identity["limit"]) if identity.get("limit") is not None else "",
        "infthor-eval": str(identity.get("infthor_eval", "")),
        "units": f"{len(run.records):,}",
        "folder": str(run.folder),
    }
    told = tuple((name, value) for name, value in facts.items() if value)
    return About(run.label, told, run.command, json.dumps(identity, indent=1, ensure_ascii=False, sort_keys=True))
