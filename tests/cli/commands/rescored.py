"""Runs for `rescore`, and what is in the runs that it makes."""

import json

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run

from ...helpers.nieh_runs import make_record
from ...helpers.printed import read_rows

REPLIES = (
    make_record(0, "Sofa", ("Sofa",)),
    make_record(1, "the soft thing", ("Sofa",)),  # unsure
    make_record(2, "Bed", ("Sofa",)),
    make_record(3, "yes", ("yes",)),
    make_record(4, "Bed", ("Bed",)),
    make_record(5, "the bin", ("Bed",)),  # unsure
    make_record(6, None, ("Bed",), failure="m fails"),
    make_record(7, "Bed, sofa", ("Bed", "Sofa", "Desk")),  # two of three
)


def read_scores(folder, metric):
    return {one.id: one.payload.scores.get(metric) for one in read_run(folder, RECORDS)[1]}


def read_journal_lines(folder):
    return (folder / "journal" / "worker-0.jsonl").read_text().splitlines()


def read_report(folder):
    return json.loads((folder / "rescored.json").read_text())


def read_row(output, beginning):
    """The rest of the row of a printed table that begins like this."""
    (row,) = [row for row in read_rows(output) if row.startswith(f"{beginning} ")]
    return row.removeprefix(f"{beginning} ")
