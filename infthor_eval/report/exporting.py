"""Tables as text for other programs: CSV, LaTeX (booktabs), Markdown."""

import csv
import io
import re
from collections.abc import Callable, Sequence

from infthor_eval.tables import Table
from infthor_eval.terminal import printable

__all__ = ["exported"]

_LATEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
}
_MARKDOWN = re.compile(r"([\\`*_\[\]<>|~#])")


def exported(tables: Sequence[Table], form: str) -> str:
    """Tables in a form; several are parted by an empty line.

    Args:
        tables: with at least one column each.
        form: csv, latex or markdown. In CSV the title and the notes are lines that begin with `#`, and where there is
            one table alone they are left out.
    """
    if form == "csv":
        return "\n".join(_csv(table, with_words=len(tables) > 1) for table in tables)
    return "\n".join({"latex": _latex, "markdown": _markdown}[form](table) for table in tables)


def _rows(table: Table, escaped: Callable[[str], str]) -> list[list[str]]:
    """Heading and rows, each with a cell per column, in one line each."""
    width = len(table.columns)
    texts = [[column.name for column in table.columns], *(list(row.cells) for row in table.rows)]
    return [[escaped(" ".join(printable(cell).split())) for cell in [*cells, *[""] * width][:width]] for cells in texts]


def _csv(table: Table, *, with_words: bool) -> str:
    text = io.StringIO()
    words = [word for word in (table.title, *table.notes) if word] if with_words else []
    text.writelines(f"# {' '.join(printable(word).split())}\n" for word in words)
    csv.writer(text, lineterminator="\n").writerows(_rows(table, str))
    return text.getvalue()


def _latex(table: Table) -> str:
    heading, *rows = _rows(table, _latex_text)
    aligned = "".join("r" if column.is_number else "l" for column in table.columns)
    lines = [rf"\begin{{tabular}}{{{aligned}}}", r"\toprule", _latex_row(heading), r"\midrule"]
    for cells, row in zip(rows, table.rows, strict=True):
        lines += [_latex_row(cells), *([r"\midrule"] if row.ends_section and cells is not rows[-1] else [])]
    lines += [r"\bottomrule", r"\end{tabular}", *(f"% {' '.join(printable(note).split())}" for note in table.notes)]
    title = [f"% {' '.join(printable(table.title).split())}"] if table.title else []
    return "\n".join([*title, *lines]) + "\n"


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _latex_text(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)


def _markdown(table: Table) -> str:
    heading, *rows = _rows(table, _markdown_text)
    rule = ["---:" if column.is_number else "---" for column in table.columns]
    title = [f"**{_markdown_text(table.title)}**", ""] if table.title else []
    lines = [f"| {' | '.join(cells)} |" for cells in (heading, rule, *rows)]
    notes = [line for note in table.notes for line in ("", _markdown_text(" ".join(printable(note).split())))]
    return "\n".join([*title, *lines, *notes]) + "\n"


def _markdown_text(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", text)
