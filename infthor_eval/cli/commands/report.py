"""`infthor-eval report`: runs as a page, or as a figure of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET, WholeNumber
from infthor_eval.cli.progress.bar import PacedBar
from infthor_eval.cli.progress.notes import print_failure, print_note
from infthor_eval.errors import UsageError
from infthor_eval.report.web.progress import PageProgress
from infthor_eval.storage.files import prepare_file, prepare_folder, require_writable
from infthor_eval.terminal import error_console, print_line, progress_bar

if TYPE_CHECKING:
    from rich.progress import Progress

    from infthor_eval.report.presenter import FigureRequest
    from infthor_eval.report.web.build import PageRequest

_PAGE = Path("results/report.html")
_INDEX = Path("results/report")
_TABLE_FORMS = ("csv", "latex", "markdown")
_FOLDER = Path("results/figures")


@example_command("report", "infthor-eval report results/*/nieh_mini-* --out report.html")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=PATH)
@click.option(
    "--out",
    type=PATH,
    help=f"The page, an .html file; or the folder of an index, or of a figure's files.  [default: "
    f"{_PAGE}, {_INDEX}, {_FOLDER}]",
)
@click.option(
    "--data",
    type=SET,
    help="Folder of the question set or the trajectories, if the runs do not name it.",
)
@click.option(
    "--scenes", type=PATH, help="Folder with recorded floor plans (thor_scenes/), as for the run."
)
@click.option(
    "--episodes",
    type=WholeNumber(0),
    default=12,
    show_default=True,
    metavar="N",
    help="Number of episodes of each run to replay, so that the page shows their frames.",
)
@click.option(
    "--tables",
    type=click.Choice(_TABLE_FORMS),
    help="Print the table of the runs in this form instead, as for a paper.",
)
@click.option(
    "--xlsx",
    type=PATH,
    metavar="FILE.xlsx",
    help="Write the table of the runs as a spreadsheet instead.",
)
@click.option(
    "--figure",
    metavar="WHICH",
    help="Draw a figure instead: 6 (reward of arms along trajectories), 7 (reward of plans over "
    "steps and context tokens), radius (success of arms by the hand's radius), pairs (net pairs of "
    "twins by distance, frames shown and age).",
)
@click.option(
    "--panels",
    type=PATH,
    metavar="FILE.yaml",
    help="Runs of each panel of a figure; else all in one.",
)
@click.option(
    "--task", help="The task to draw if the runs share several; for arms, one of each kind: A,B."
)
def command(
    runs: tuple[Path, ...],
    out: Path | None,
    data: Path | None,
    scenes: Path | None,
    episodes: int,
    tables: str | None,
    xlsx: Path | None,
    figure: str | None,
    panels: Path | None,
    task: str | None,
) -> None:
    """Write the results of the runs in the folders RUN... as one page that works offline: numbers,
    charts, samples.

    Of a folder with runs below it, or with a folder as --out, write an index: a page with all runs,
    and a page for each.

    With --figure, draw a figure of the paper instead, as PNG and SVG. A run of the baseline
    `planner`, or `planner-arm`, among them is the upper bound. Only trajectories that all runs have
    are drawn.
    """
    from infthor_eval.report.presenter import FigureRequest
    from infthor_eval.report.web.build import PageRequest

    forms = {"--tables": tables, "--xlsx": xlsx, "--figure": figure}
    given = [option for option, value in forms.items() if value is not None]
    if len(given) > 1:
        raise UsageError(f"{' and '.join(given)}: are for different things; leave out all but one")
    if figure is not None:
        _draw(runs, figure, FigureRequest(task, panels), out or _FOLDER)
        return
    for option, value in {"--panels": panels, "--task": task}.items():
        if value is not None:
            raise UsageError(f"{option}: is for a figure; give --figure too, or leave it out")
    folders = _runs_among(runs)
    if tables is not None or xlsx is not None:
        _export_table(folders, tables, xlsx)
        return
    request = PageRequest(data, scenes, episodes)
    no_runs = set(runs) - set(folders)
    is_above = any(not no_runs.isdisjoint(folder.parents) for folder in folders)
    if (is_above and out is None) or (out is not None and not out.suffix):
        _write_index(folders, request, out or _INDEX)
    else:
        _write_page(folders, request, out or _PAGE)


def _export_table(folders: Sequence[Path], form: str | None, spreadsheet: Path | None) -> None:
    """Print the table of the runs in a form, or write it as a spreadsheet."""
    from infthor_eval.report.exporting import export_tables
    from infthor_eval.report.headline.results import task_results
    from infthor_eval.report.headline.tables import results_table
    from infthor_eval.report.spreadsheet import prepare_spreadsheet, write_spreadsheet
    from infthor_eval.run import open_runs

    if spreadsheet is not None:
        prepare_spreadsheet(spreadsheet)
    runs = open_runs(folders, print_failure)
    table = results_table([result for run in runs for result in task_results(run)])
    if form is not None:
        click.echo(export_tables([table], form), nl=False)
    if spreadsheet is not None:
        write_spreadsheet(spreadsheet, [table])
        print_line(f"{spreadsheet}: {len(table.rows)} rows")


def _write_index(folders: Sequence[Path], request: PageRequest, out: Path) -> None:
    from infthor_eval.report.web.index import write_index

    with progress_bar(error_console()) as progress:
        index = write_index(folders, out, request, _PageBars(progress))
    for problem in index.problems:
        print_failure(problem)
    print_line(f"{index.n_runs:,} runs, {index.size / 1e6:.1f} MB: {index.path}")


def _write_page(folders: Sequence[Path], request: PageRequest, out: Path) -> None:
    from infthor_eval.report.web.build import build_page
    from infthor_eval.report.web.page import write_page
    from infthor_eval.run import open_runs

    if out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out {out}: the page is an .html file; name one")
    path = prepare_file(out)
    runs = open_runs(folders, print_failure)
    with progress_bar(error_console()) as progress:
        page = build_page(runs, request, _PageBars(progress))
    size = write_page(page, path)
    print_line(
        f"{len(page.samples):,} samples, {len(page.pictures):,} pictures, {size / 1e6:.1f} MB: "
        f"{path}"
    )


def _runs_among(paths: Sequence[Path]) -> list[Path]:
    """Return the folders of runs, also below other folders; of another path, such as an earlier
    page, it is said that it is none."""
    from infthor_eval.runs.stored.search import run_folders

    # What does not exist is refused where it is read.
    found = {
        path: list(run_folders(path)) if path.is_dir() else [] if path.exists() else [path]
        for path in paths
    }
    runs = [run for below in found.values() for run in below]
    if not runs:
        raise UsageError(f"{paths[0]}: no run, nor is another of the paths; give folders of runs")
    for path, below in found.items():
        if not below:
            print_note(f"skipped: {path}: no run", "yellow")
    return runs


class _PageBars(PageProgress):
    """See `PageProgress`: a bar per piece of work on a terminal, lines elsewhere."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._bars: dict[str, PacedBar] = {}

    def begin(self, what: str, n: int) -> None:
        self._bars[what] = PacedBar(self._progress, what, n)

    def advance(self, what: str, detail: str = "") -> None:
        self._bars[what].advance(detail=detail)


def _draw(folders: tuple[Path, ...], name: str, request: FigureRequest, out: Path) -> None:
    from infthor_eval.report.figures import save_figure
    from infthor_eval.report.named_figures import build_figure
    from infthor_eval.report.terminal import print_table, table_console

    require_writable(out)
    result = build_figure(folders, name, request, print_failure)
    file_name = f"figure{name}" if name.isdigit() else name
    paths = save_figure(result.plot, prepare_folder(out), file_name)
    print_table(result.table, table_console())
    for line in (*result.notes, *map(str, paths)):
        print_line(line)
