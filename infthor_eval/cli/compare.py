"""`infthor-eval compare`: two runs on the same questions."""

from pathlib import Path

import click

from infthor_eval.cli.options import table_console

__all__ = ["command"]


@click.command("compare")
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
def command(first: Path, second: Path) -> None:
    """Say by how much the run in folder SECOND is better than that in FIRST.

    Questions are paired, intervals and p values are clustered by trajectory.
    """
    from infthor_eval.report import compare, comparison_table
    from infthor_eval.runs import read_journal

    identities, records = zip(*(read_journal(folder / "journal.jsonl") for folder in (first, second)), strict=True)
    names = [identity.get("model", {}).get("name", "?") for identity in identities]
    table_console().print(comparison_table(compare(*records), *names))
