"""`infthor-eval fetch`: published data from the Hugging Face hub."""

from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH


@example_command("fetch", "infthor-eval fetch nieh")
@click.argument("what", type=click.Choice(["nieh"]))
@click.option("--out", "--dir", "folder", type=PATH, help="Folder for the data, not the cache.")
@click.option("--token", help="Access token; default: the one that `hf auth login` stored.")
@click.option("--endpoint", hidden=True, help="Another hub.")
def command(what: str, folder: Path | None, token: str | None, endpoint: str | None) -> None:
    """Download, unpack and check the published NIEH data.

    Tasks such as `--tasks nieh` find it without --data; after --out DIR, they need --data DIR.
    """
    from infthor_eval.cli.progress.notes import print_left_out
    from infthor_eval.nieh.published.hub_data import default_folder, fetch_nieh
    from infthor_eval.storage.files import hold_folder
    from infthor_eval.terminal import print_line

    with hold_folder(folder or default_folder(), "--out") as target:
        data = fetch_nieh(target, token, endpoint)
    print_line(f"{what}: {len(data.questions)} questions in {data.root}")
    print_left_out(data.root, data.skipped)
