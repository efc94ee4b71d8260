"""`infthor-eval submit-check` and `leaderboard`: what strangers send, and what of it passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from infthor_eval.cli.help import ExampleCommand
from infthor_eval.cli.options.values import PATH, split_names

if TYPE_CHECKING:
    from infthor_eval.report.leaderboard.page import LeaderboardRow
    from infthor_eval.submissions.checking import Verdict

__all__ = ["leaderboard", "submit_check"]

_TITLE = "Memory of long embodied trajectories"


def _checking_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that both commands check by."""
    for option in (
        click.option(
            "--include-path", "include", multiple=True, type=PATH, help="Folder of task files."
        ),
        click.option(
            "--allow",
            metavar="CHECK,...",
            help="Do not refuse by these checks, as you have looked.",
        ),
        click.option(
            "--key",
            type=PATH,
            metavar="KEY",
            help="Key of a private set, for runs on its public part.",
        ),
        click.option(
            "--data",
            "sets",
            multiple=True,
            type=PATH,
            metavar="SET",
            help="Set of tasks that have no bundled one; may be repeated.",
        ),
    ):
        command = option(command)
    return command


@click.command(
    "submit-check", cls=ExampleCommand, example="infthor-eval submit-check my_submission"
)
@click.argument("folder", type=PATH)
@click.option(
    "--others",
    type=PATH,
    metavar="DIR",
    help="Folder of earlier submissions, from which nothing may be copied.",
)
@_checking_options
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON, one a line.")
def submit_check(
    folder: Path,
    others: Path | None,
    sets: tuple[Path, ...],
    key: Path | None,
    allow: str | None,
    include: tuple[Path, ...],
    as_json: bool,
) -> int:
    """Check submissions before they are believed (docs/submit.md).

    FOLDER is a submission: `submission.yaml` beside runs, or beside exports of them; or a folder of
    submissions, which are compared with each other. Scores are made again from the replies. Exit
    code 1 if one is refused.
    """
    import msgspec

    from infthor_eval.terminal import print_line

    verdicts = _check(folder, sets, key, allow, include, others)
    for verdict in verdicts:
        lines = [msgspec.json.encode(_document(verdict)).decode()] if as_json else _lines(verdict)
        for line in lines:
            print_line(line)
    return int(any(verdict.refusals for verdict in verdicts))


@click.command(
    "leaderboard",
    cls=ExampleCommand,
    example="infthor-eval leaderboard submissions --out leaderboard.html",
)
@click.argument("folder", type=PATH)
@click.option("--out", type=PATH, required=True, metavar="FILE.html", help="The page.")
@click.option("--title", default=_TITLE, show_default=True, help="Title of the page.")
@click.option("--no-published", is_flag=True, help="Leave out the published rows of the paper.")
@_checking_options
def leaderboard(
    folder: Path,
    out: Path,
    title: str,
    no_published: bool,
    sets: tuple[Path, ...],
    key: Path | None,
    allow: str | None,
    include: tuple[Path, ...],
) -> int:
    """Write a page of the submissions in FOLDER that pass `submit-check`: one file, no network.

    Those that are refused are named, and not on it; the exit code is then 1.
    """
    import infthor_eval
    from infthor_eval.cli.progress.notes import print_failure, print_note
    from infthor_eval.report.leaderboard.page import write_leaderboard
    from infthor_eval.storage.files import prepare_file
    from infthor_eval.submissions.rows import published_rows, rows_of

    prepare_file(out)
    verdicts = _check(folder, sets, key, allow, include)
    rows: list[LeaderboardRow] = []
    n_refused = 0
    for verdict in verdicts:
        n_refused += bool(verdict.refusals)
        if verdict.refusals:
            for line in _lines(verdict):
                print_failure(line)
        else:
            rows += rows_of(verdict)
    n_checked = len(rows)
    if not no_published:
        rows += published_rows()
    size = write_leaderboard(
        rows, out, title=title, version=infthor_eval.__version__, refused=n_refused
    )
    counts = f"{n_checked} rows, {len(rows) - n_checked} published ones, {n_refused} refused"
    print_note(f"{out}: {counts}, {size / 1000:,.0f} KB")
    return int(n_refused > 0)


def _check(
    folder: Path,
    sets: Sequence[Path],
    key: Path | None,
    allow: str | None,
    include: Sequence[Path],
    others: Path | None = None,
) -> list[Verdict]:
    from infthor_eval.errors import unknown_name
    from infthor_eval.submissions.checking import CHECKS, check_submissions
    from infthor_eval.submissions.expected import Owner

    names = [check.name for check in CHECKS]
    allowed = () if allow is None else split_names(allow, "--allow")
    for name in allowed:
        if name not in names:
            raise unknown_name("check", name, names)
    return check_submissions(folder, Owner(sets, include, key), others, allowed)


def _lines(verdict: Verdict) -> list[str]:
    name = verdict.case.submission.name
    n = len(verdict.refusals)
    outcome = f"refused, {n} reason{'s' if n > 1 else ''}" if n else "passes"
    return [
        f"{name}: {outcome}",
        *(f"  {problem.check}: {problem.text}" for problem in verdict.refusals),
        *(f"  remark, {problem.check}: {problem.text}" for problem in verdict.warnings),
    ]


def _document(verdict: Verdict) -> dict[str, Any]:
    return {
        "submission": verdict.case.submission.name,
        "passes": not verdict.refusals,
        "refusals": [{"check": it.check, "reason": it.text} for it in verdict.refusals],
        "remarks": [{"check": it.check, "reason": it.text} for it in verdict.warnings],
    }
