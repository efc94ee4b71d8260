"""`infthor-eval card`: what is said of a set when it is published."""

import re
from datetime import UTC, date, datetime
from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET

_PICTURE = "card.png"
_DAY = re.compile(r"\d{4}-\d{2}-\d{2}")


def _read_day(_context: click.Context, _option: click.Parameter, text: str | None) -> str:
    if text is None:
        return datetime.now(UTC).date().isoformat()
    try:
        if _DAY.fullmatch(text):
            return date.fromisoformat(text).isoformat()
    except ValueError:  # 2026-02-30
        pass
    raise click.BadParameter(f"{text!r} is no day; write YYYY-MM-DD")


@example_command("card", "infthor-eval card my_twins --licence CC-BY-4.0 --creator Me")
@click.argument("set_folder", metavar="SET", type=SET)
@click.option("--licence", required=True, metavar="ID", help="SPDX identifier: CC-BY-4.0, MIT.")
@click.option("--name", metavar="TEXT", help="Name of the set; default: that of its folder.")
@click.option("--set-version", metavar="TEXT", default="1.0.0", show_default=True)
@click.option("--creator", "creators", metavar="NAME", multiple=True, help="Can be repeated.")
@click.option("--url", metavar="URL", help="Where the set can be had.")
@click.option("--citation", metavar="FILE.bib", type=PATH, help="How to cite it.")
@click.option(
    "--day", metavar="YYYY-MM-DD", callback=_read_day, help="Of publication; default: today."
)
@click.option("--out", metavar="DIR", type=PATH, help="Folder of the card; default: SET.")
def command(
    set_folder: Path,
    licence: str,
    name: str | None,
    set_version: str,
    creators: tuple[str, ...],
    url: str | None,
    citation: Path | None,
    day: str,
    out: Path | None,
) -> None:
    """Write a data set card and a Croissant file with the responsible-AI fields.

    README.md, croissant.json and a picture are written beside the set's files. They say what is in
    the set, how it was made, what can be guessed of it, and what its limits are.
    """
    import json

    from infthor_eval.cli.progress.notes import NOTES, print_left_out
    from infthor_eval.errors import wrap_errors
    from infthor_eval.formats.reading import read_text
    from infthor_eval.report.cards.croissant import croissant
    from infthor_eval.report.cards.facts import About, read_facts
    from infthor_eval.report.cards.markdown import card
    from infthor_eval.report.cards.pictures import draw_example
    from infthor_eval.storage.files import prepare_folder, write_atomically, writing_hint
    from infthor_eval.terminal import print_line

    about = About(
        name=name or set_folder.resolve().stem,
        licence=licence,
        version=set_version,
        published=day,
        url=url,
        creators=creators,
        citation=read_text(citation, "give a text file") if citation else "",
    )
    with NOTES.status("counting what is in the set"):
        facts = read_facts(set_folder)
    print_left_out(facts.data.root, facts.data.skipped)
    folder = prepare_folder(out or facts.data.directory)
    with wrap_errors(f"{folder}: cannot be written", writing_hint(", or give another --out")):
        caption = draw_example(facts.data, folder / _PICTURE)
        described = json.dumps(croissant(facts, about), indent=1, ensure_ascii=False) + "\n"
        text = card(facts, about, {_PICTURE: caption} if caption else {})
        for file, content in (("croissant.json", described), ("README.md", text)):
            with write_atomically(folder / file) as partial:
                partial.write_text(content, encoding="utf-8")
            print_line(str(folder / file))
