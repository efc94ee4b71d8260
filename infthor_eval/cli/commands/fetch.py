"""`infthor-eval fetch`: published data from the Hugging Face hub."""

from pathlib import Path

import click

__all__ = ["command"]


@click.command("fetch")
@click.argument("what", type=click.Choice(["nieh"]))
@click.option("--dir", "folder", type=click.Path(path_type=Path), help="Where to keep it, instead of the cache.")
@click.option("--token", help="Access token; without it, the one that `hf auth login` stored.")
@click.option("--endpoint", hidden=True, help="Another hub.")
def command(what: str, folder: Path | None, token: str | None, endpoint: str | None) -> None:
    """Download the published NIEH data, unpack and check it.

    `--tasks nieh` finds it afterwards; with --dir, pass the same folder as --data.
    """
    from infthor_eval.formats.files import prepare_folder
    from infthor_eval.formats.hub_data import default_folder, fetch_nieh
    from infthor_eval.terminal import error_console, print_line

    data = fetch_nieh(prepare_folder(folder or default_folder(), "--dir"), token, endpoint)
    print_line(f"{what}: {len(data.questions)} questions in {data.root}")
    for reason, n in data.reasons().most_common():
        error_console().print(f"skipped {n}: {reason}")
