"""From runs to the page: its sections and its samples."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import infthor_eval
from infthor_eval.errors import DataError
from infthor_eval.report.comparison import compare, comparison_table
from infthor_eval.report.headline.results import TaskResult, task_results
from infthor_eval.report.headline.sentence import headline
from infthor_eval.report.headline.tables import cost_chart, results_chart, results_table
from infthor_eval.report.web.page import About, Page, SuiteLabels, embedded_remark
from infthor_eval.report.web.progress import PageProgress
from infthor_eval.report.web.replays import EpisodeReplays
from infthor_eval.report.web.run_tables import costs_table, left_out_table
from infthor_eval.report.web.sample_list import SharedTexts, build_samples
from infthor_eval.report.web.samples import PageSample
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run

_SUMMARIES = "runs summarised"
_FEW = 4  # runs of which each is compared with each


@dataclass(frozen=True)
class PageRequest:
    """Options of the page.

    Attributes:
        data: folder of the questions' set, or of the trajectories; None for the one that each run
            names.
        scenes: folder of recorded floor plans, for replays.
        episodes: number of episodes of each run to replay.
        pictures: maximum size of all pictures together, in bytes.
        is_packed: see `Page`.
    """

    data: Path | None = None
    scenes: Path | None = None
    episodes: int = 12
    pictures: int = 15_000_000
    is_packed: bool = False


def build_page(
    runs: Sequence[Run], request: PageRequest, progress: PageProgress | None = None
) -> Page:
    """Build the page of some runs, of one suite or of several; `progress` observes what takes
    long."""
    progress = progress or PageProgress()
    by_suite: dict[str, list[Run]] = {}
    progress.begin(_SUMMARIES, len(runs))
    for run in runs:
        by_suite.setdefault(run.suite.name, []).append(run)
        _ = run.summary  # computed once, here, where it is seen to take its time
        progress.advance(_SUMMARIES, run.label)
    results = [
        result for place, run in enumerate(runs) for result in task_results(run, f"#run-{place}")
    ]
    sections = [results_section(results)]
    for same in by_suite.values():
        sections += _suite_sections(same)
    sections += _comparisons(by_suite.values())
    costs = cost_chart(results)
    sections.append(
        Section("cost", "Speed and cost", () if costs is None else (costs,), (costs_table(runs),))
    )
    left_out = left_out_table(runs)
    if left_out is not None:
        sections.append(Section("left-out", "Failed, not asked, skipped", tables=(left_out,)))
    thumbnails = ThumbnailStore(request.pictures, progress=progress)
    replays = EpisodeReplays(
        runs, request.episodes, (request.data, request.scenes), thumbnails, progress
    )
    samples: list[PageSample] = []
    notes: list[str] = []
    texts = SharedTexts()
    for same in by_suite.values():
        of_suite = build_samples(same, request.data, replays, thumbnails, texts)
        run_indices = [runs.index(run) for run in same]
        samples += [sample.spread_over(len(runs), run_indices) for sample in of_suite.samples]
        notes += of_suite.notes
    if thumbnails.n_left_out:
        notes.append(f"{thumbnails.n_left_out:,} pictures left out, to keep the page small")
    return Page(
        title=_title(runs),
        is_packed=request.is_packed,
        remark=_remark(runs),
        version=infthor_eval.__version__,
        runs=[_about(run) for run in runs],
        suites={name: _labels(runs, same) for name, same in by_suite.items()},
        sections=[section for section in sections if not section.is_empty],
        samples=samples,
        metrics=_metrics(runs, samples),
        pictures=thumbnails.encoded,
        notes=notes,
        large=thumbnails.large,
        frames=texts.frames.values,
        prompts=texts.prompts.values,
        tracebacks=texts.tracebacks.values,
        explanations=texts.explanations.values,
    )


def results_section(results: Sequence[TaskResult]) -> Section:
    """Return the section that a page opens with."""
    chart = results_chart(results)
    return Section(
        "results",
        "Results",
        () if chart is None else (chart,),
        (results_table(results),),
        lead=headline(results),
        is_sortable=True,
    )


def _title(runs: Sequence[Run]) -> str:
    names = ", ".join(run.label for run in runs)
    return names if len(names) <= 60 else f"{len(runs)} runs"


def _remark(runs: Sequence[Run]) -> str:
    """Return the remark on the runs of the page in the embedded simulator; empty without any."""
    embedded = [run.label for run in runs if "embedded" in run.header.config.simulators]
    if not embedded:
        return ""
    which = "" if len(embedded) == len(runs) else f" ({', '.join(embedded)})"
    return embedded_remark(which)


def _suite_sections(runs: Sequence[Run]) -> Iterator[Section]:
    suite = runs[0].suite
    presenter = runs[0].presenter
    title = presenter.title or suite.name.replace("_", " ").capitalize()
    opening = presenter.opening(runs) or Section("", "")
    if not opening.is_empty:
        yield opening
    tables = suite.tables([run.summary for run in runs])
    tables = [table for table in tables if table not in opening.tables]
    yield Section(suite.name, title, tuple(presenter.charts(runs)), tuple(tables))
    for section in presenter.sections(runs):
        yield replace(section, is_linked=False)


def _comparisons(suites: Iterable[Sequence[Run]]) -> Iterator[Section]:
    """Each run against each before it, of its suite; if there are many, each against the first."""
    tables = []
    notes = []
    for runs in suites:
        pairs = (
            combinations(runs, 2) if len(runs) <= _FEW else ((runs[0], other) for other in runs[1:])
        )
        for first, second in pairs:
            try:
                rows = compare(first.suite, first.presenter, first.records, second.records)
            except DataError as error:
                notes.append(f"{second.label} against {first.label}: {error}")
                continue
            tables.append(comparison_table(rows, first.label, second.label))
        if len(runs) > _FEW:
            notes.append(f"each run against {runs[0].label}; infthor-eval compare shows any two")
    if tables or notes:
        yield Section("comparison", "Comparison", (), tuple(tables), tuple(notes))


def _labels(runs: Sequence[Run], same: Sequence[Run]) -> SuiteLabels:
    presenter = same[0].presenter
    run_indices = tuple(runs.index(run) for run in same)
    return SuiteLabels(
        run_indices,
        presenter.target_label,
        presenter.reply_label,
        presenter.compares_scorers,
        presenter.member_label,
    )


def _metrics(runs: Sequence[Run], samples: Sequence[PageSample]) -> list[str]:
    """Names of all metrics; those that decide the outcome first."""
    main = {run.presenter.main_metric for run in runs}
    names = dict.fromkeys(
        name
        for sample in samples
        for part in sample.parts
        for result in part.results
        if result is not None
        for name in result.scores
    )
    return sorted(names, key=lambda name: name not in main)


def _state(run: Run) -> str:
    """Return how many samples have a result, and what became of the others; empty for a whole
    run."""
    units = list(run.summary.units.values())
    failed = sum(counts.failed for counts in units)
    not_asked = sum(counts.not_asked for counts in units)
    if not failed + not_asked:
        return ""
    answered = sum(counts.answered for counts in units)
    return f"{answered:,} answered, {failed:,} failed, {not_asked:,} not asked"


def _about(run: Run) -> About:
    config = run.header.config
    facts = {
        "suite": run.suite.name,
        "model": str(config.model.get("name", "")),
        "checkpoint": str(config.model.get("checkpoint", "")),
        "tasks": ", ".join(run.tasks),
        "simulator": run.simulator,
        "seed": "" if config.seed is None else str(config.seed),
        "limit": "" if config.limit is None else str(config.limit),
        "infthor-eval": config.infthor_eval,
        "samples": f"{len(run.records):,}",
        "state": _state(run),
        "folder": str(run.folder),
    }
    known = tuple((name, value) for name, value in facts.items() if value)
    return About(
        run.label,
        known,
        run.command,
        json.dumps(config.document, indent=1, ensure_ascii=False, sort_keys=True),
    )
