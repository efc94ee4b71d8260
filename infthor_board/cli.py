"""`infthor-board`: check what strangers send, write the page of what passes, make secret sets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import infthor_eval
from infthor_eval.cli.main import Program, run_program
from infthor_eval.cli.options.values import PATH, default_option, split_names, together
from infthor_eval.cli.options.workers import parse_worker_settings, worker_options
from infthor_eval.cli.progress.notes import NOTES, print_failure, print_note
from infthor_eval.storage.files import hold_folder, prepare_file
from infthor_eval.terminal import print_line, progress_bar

if TYPE_CHECKING:
    from infthor_board.checking import Verdict
    from infthor_board.page import LeaderboardRow

_TITLE = "Memory of long embodied trajectories"


def main(args: list[str] | None = None) -> None:
    """Run the command line."""
    run_program(_infthor_board, args)


@click.group("infthor-board", cls=Program, example="infthor-board check my_submission")
@click.version_option(infthor_eval.__version__, prog_name="infthor-board")
def _infthor_board() -> None:
    """Check submissions of results, write a page of those that pass, and make secret sets."""


# The options that both commands check by; they pass them to `_check`.
_checking_options = together(
    click.option(
        "--data",
        "sets",
        multiple=True,
        type=PATH,
        metavar="SET",
        help="Set of tasks that have no bundled one; may be repeated.",
    ),
    click.option(
        "--key",
        type=PATH,
        metavar="KEY",
        help="Key of a private set, for runs on its public part.",
    ),
    click.option(
        "--allow",
        metavar="CHECK,...",
        help="Do not refuse by these checks, as you have looked.",
    ),
    click.option(
        "--include-path", "include", multiple=True, type=PATH, help="Folder of task files."
    ),
)


@_infthor_board.command("check", example="infthor-board check my_submission")
@click.argument("folder", type=PATH)
@click.option(
    "--others",
    type=PATH,
    metavar="DIR",
    help="Folder of earlier submissions, from which nothing may be copied.",
)
@_checking_options
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON, one a line.")
def check(folder: Path, others: Path | None, as_json: bool, **checking: Any) -> int:
    """Check submissions before they are believed (docs/submit.md).

    FOLDER is a submission: `submission.yaml` beside runs, or beside exports of them; or a folder of
    submissions, which are compared with each other. Scores are made again from the replies. Exit
    code 1 if one is refused.
    """
    import msgspec

    verdicts = _check(folder, others, **checking)
    for verdict in verdicts:
        lines = [msgspec.json.encode(_document(verdict)).decode()] if as_json else _lines(verdict)
        for line in lines:
            print_line(line)
    return int(any(verdict.refusals for verdict in verdicts))


@_infthor_board.command("page", example="infthor-board page submissions --out leaderboard.html")
@click.argument("folder", type=PATH)
@click.option("--out", type=PATH, required=True, metavar="FILE.html", help="The page.")
@click.option("--title", default=_TITLE, show_default=True, help="Title of the page.")
@click.option("--no-published", is_flag=True, help="Leave out the published rows of the paper.")
@_checking_options
def page(folder: Path, out: Path, title: str, no_published: bool, **checking: Any) -> int:
    """Write a page of the submissions that pass `check`.

    FOLDER is as for `check`; the page is one file that loads nothing. Submissions that are refused
    are named, and not on it; the exit code is then 1.
    """
    from infthor_board.page import write_leaderboard
    from infthor_board.rows import published_rows, rows_of

    prepare_file(out)
    verdicts = _check(folder, None, **checking)
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


@_infthor_board.command(
    "private-set", example="infthor-board private-set --seed-file secret.txt --out held_out"
)
@click.option(
    "--seed-file",
    type=PATH,
    required=True,
    metavar="FILE",
    help="The secret: 32 hexadecimal digits or more (openssl rand -hex 32).",
)
@click.option("--out", type=PATH, required=True, metavar="DIR", help="Folder of both parts.")
@default_option("--homes", click.IntRange(1), 12, "A trajectory in each.")
@click.option("--kinds", metavar="KIND,...", help="Kinds of edits, with commas; default: all.")
@default_option("--min-steps", click.IntRange(1), 300, "Steps of each trajectory, at least.")
@default_option(
    "--per-trajectory", click.IntRange(1), 25, "Paired questions of one trajectory, at most."
)
@worker_options
def private_set(
    seed_file: Path,
    out: Path,
    homes: int,
    kinds: str | None,
    min_steps: int,
    per_trajectory: int,
    **workers: Any,
) -> int:
    """Make a set of twins whose answers stay secret.

    DIR/public has frames and questions without answers; DIR/key has all else and is needed to score
    (`infthor-eval rescore --key`, `check --key`). The same secret makes the same files
    (docs/submit.md). Exit code 1 if no twins can be made of a home.
    """
    from infthor_board.private_sets import make_private_set, read_secret
    from infthor_eval.cli.commands.data.questions import parse_kinds
    from infthor_eval.cli.progress.bar import PacedBar

    secret = read_secret(seed_file)
    worker_settings = parse_worker_settings(**workers)
    with hold_folder(out), progress_bar(NOTES) as progress:
        bars = {name: PacedBar(progress, name, homes) for name in ("trajectories", "twins")}
        made = make_private_set(
            secret,
            out,
            kinds=parse_kinds(kinds),
            n_homes=homes,
            min_steps=min_steps,
            per_trajectory=per_trajectory,
            worker_settings=worker_settings,
            advance=lambda name, resumed: bars[name].advance(resumed),
            notify=print_note,
        )
    print_line(f"{made.n_pairs} pairs of questions on {made.n_trajectories} trajectories")
    print_line(f"to publish: {made.public}")
    print_line(f"to keep secret: {made.key}, {seed_file}")
    for failure in made.failures:
        print_failure(f"left out: {failure}")
    return int(bool(made.failures))


def _check(
    folder: Path,
    others: Path | None,
    *,
    sets: Sequence[Path],
    key: Path | None,
    allow: str | None,
    include: Sequence[Path],
) -> list[Verdict]:
    from infthor_board.checking import CHECKS, check_submissions
    from infthor_board.expected import Owner
    from infthor_eval.errors import unknown_name

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
