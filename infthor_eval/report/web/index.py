"""An index of runs: a page with all of them, and a page for each, made by several processes."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import infthor_eval
from infthor_eval.errors import InfthorError
from infthor_eval.process_settings import safe_path
from infthor_eval.report.headline.results import TaskResult, task_results
from infthor_eval.report.web.build import PageRequest, build_page, results_section
from infthor_eval.report.web.page import Page, embedded_remark, write_page
from infthor_eval.report.web.progress import PageProgress
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import n_processors
from infthor_eval.run import Run, with_distinct_names
from infthor_eval.storage.files import file_name, prepare_folder
from infthor_eval.tables import Column, Row, Table

_WORK = "pages of runs"
_PICTURES = 20_000_000  # bytes of the pictures of all pages
_FEWEST_PICTURES = 2_000_000  # bytes for a page; with less, no page has pictures
_FEW = 4  # runs that one process is quicker with, as each further one takes seconds to start


@dataclass(frozen=True)
class Index:
    """An index that was written.

    Attributes:
        path: its page.
        n_runs: number of runs with a page.
        size: bytes of all pages.
        problems: runs that could not be read, or parts of them, a line each.
    """

    path: Path
    n_runs: int
    size: int
    problems: Sequence[str]


@dataclass(frozen=True)
class _Job:
    """A run whose page is to be made: its name beside the others, and the place of the page."""

    folder: Path
    name: str
    page: Path


@dataclass(frozen=True)
class _Made:
    """What a run's page holds for the index; without results if the run cannot be read."""

    results: Sequence[TaskResult] = ()
    size: int = 0
    remark: str = ""
    problems: Sequence[str] = ()
    failure: str = ""


def write_index(
    folders: Sequence[Path], out: Path, request: PageRequest, progress: PageProgress
) -> Index:
    """Write the page of each run, and `index.html`, into a folder.

    Args:
        folders: folders of the runs, at least one; one that cannot be read is named on the page.
        out: the folder.
        request: options of the runs' pages. Of more than ten runs no page has pictures.
        progress: observes the pages.
    """
    pages = prepare_folder(out / "runs")
    jobs, unread = _plan(folders, pages)
    share = min(request.pictures, _PICTURES // max(len(jobs), 1))
    has_pictures = share >= _FEWEST_PICTURES
    request = replace(
        request,
        pictures=share if has_pictures else 0,
        episodes=request.episodes if has_pictures else 0,
        is_packed=True,
    )
    progress.begin(_WORK, len(jobs))
    made: dict[_Job, _Made] = {}
    with _executor(len(jobs)) as executor:
        for job, one in _make_all(jobs, request, executor):
            made[job] = one
            progress.advance(_WORK, job.name)
    in_order = [(job, made[job]) for job in jobs]
    failures = [*unread, *((str(job.folder), one.failure) for job, one in in_order if one.failure)]
    path = out / "index.html"
    size = write_page(_index_page([one for _, one in in_order], failures), path)
    problems = [problem for _, one in in_order for problem in one.problems]
    return Index(
        path=path,
        n_runs=sum(not one.failure for one in made.values()),
        size=size + sum(one.size for one in made.values()),
        problems=[*problems, *(f"{folder}: not read: {reason}" for folder, reason in failures)],
    )


def _plan(folders: Sequence[Path], pages: Path) -> tuple[list[_Job], list[tuple[str, str]]]:
    """Return the runs with their names and pages, and those whose header cannot be read."""
    runs: list[Run] = []
    unread = []
    for folder in folders:
        try:
            runs.append(Run.open(folder))
        except InfthorError as error:
            unread.append((str(folder), str(error)))
    jobs = []
    for number, run in enumerate(with_distinct_names(runs)):
        page = pages / f"{number:04}-{file_name(run.listed.name)}.html"
        jobs.append(_Job(run.folder, run.name, page))
    return jobs, unread


@contextmanager
def _executor(n_jobs: int) -> Iterator[Executor | None]:
    """Open processes for so many pages; None where one process is enough."""
    n_workers = min(n_processors(), n_jobs)
    if n_workers < 2 or n_jobs <= _FEW:
        yield None
        return
    with safe_path(), ProcessPoolExecutor(n_workers, get_context("spawn")) as executor:
        yield executor


def _make_all(
    jobs: Sequence[_Job], request: PageRequest, executor: Executor | None
) -> Iterator[tuple[_Job, _Made]]:
    if executor is None:
        yield from ((job, _make(job, request)) for job in jobs)
        return
    futures: dict[Future[_Made], _Job] = {executor.submit(_make, job, request): job for job in jobs}
    yield from ((futures[future], future.result()) for future in as_completed(futures))


def _make(job: _Job, request: PageRequest) -> _Made:
    """Write the page of a run, and return what the index says of it."""
    problems: list[str] = []
    try:
        run = Run.open(job.folder, problems.append).named(job.name).read()
        page = build_page([run], request)
    except InfthorError as error:
        return _Made(problems=problems, failure=str(error))
    size = write_page(page, job.page)
    link = f"{job.page.parent.name}/{job.page.name}"
    return _Made(list(task_results(run, link)), size, page.remark, problems)


def _index_page(made: Iterable[_Made], failures: Sequence[tuple[str, str]]) -> Page:
    read = [one for one in made if not one.failure]
    results = [result for one in read for result in one.results]
    sections = [results_section(results)]
    if failures:
        columns = (Column("run", False), Column("reason", False))
        table = Table("", columns, tuple(map(Row, failures)))
        sections.append(Section("unread", "Not read", tables=(table,)))
    n_embedded = sum(bool(one.remark) for one in read)
    which = "" if n_embedded == len(read) else f" ({n_embedded} of the runs)"
    return Page(
        title=f"{len(read)} {'run' if len(read) == 1 else 'runs'}",
        version=infthor_eval.__version__,
        sections=sections,
        remark=embedded_remark(which) if n_embedded else "",
    )
