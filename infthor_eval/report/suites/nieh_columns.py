"""Columns of NIEH in the table of samples."""

from functools import partial
from typing import Any

from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.above_blind import score_above_blind
from infthor_eval.nieh.results.facets import FACETS
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.report.sample_columns import SampleColumn, payload_column
from infthor_eval.runs import UnitRecord


def _blind_score(scorer: str, record: UnitRecord[NiehAnswer]) -> float | None:
    blind = record.payload.blind
    return None if blind is None else blind.scores.get(scorer)


def _above_blind(scorer: str, record: UnitRecord[NiehAnswer]) -> float | None:
    return score_above_blind(record.payload, scorer)


def _in_part(part: str, name: str, record: UnitRecord[NiehAnswer]) -> Any:
    """Return a field of a part of the payload, None where the payload has no such part."""
    return getattr(getattr(record.payload, part), name, None)


def _n_recalled(record: UnitRecord[NiehAnswer]) -> int | None:
    recall = record.payload.recall
    return None if recall is None else len(recall.recalled)


NIEH_COLUMNS = (
    payload_column("question", str),
    payload_column("question_type", str),
    SampleColumn("answers", str, lambda record: ", ".join(map(str, record.payload.answers))),
    payload_column("reply", str),
    payload_column("thinking", str),
    payload_column("file", str),
    payload_column("moment", int),
    payload_column("n_clues", int),
    SampleColumn("n_clues_shown", int, partial(_in_part, "shown_clues", "n_shown")),
    SampleColumn("n_frames_after_clues", int, partial(_in_part, "shown_clues", "n_after")),
    *(SampleColumn(f"blind_{scorer}", float, partial(_blind_score, scorer)) for scorer in SCORERS),
    *(
        SampleColumn(f"above_blind_{scorer}", float, partial(_above_blind, scorer))
        for scorer in SCORERS
    ),
    SampleColumn("pair", str, partial(_in_part, "twin", "pair")),
    SampleColumn("fact", str, partial(_in_part, "twin", "fact")),
    SampleColumn("age", int, partial(_in_part, "twin", "age")),
    SampleColumn("span", int, partial(_in_part, "twin", "span")),
    SampleColumn("n_recalled", int, _n_recalled),
    SampleColumn("build_seconds", float, partial(_in_part, "recall", "build_s")),
    SampleColumn("recall_seconds", float, partial(_in_part, "recall", "recall_s")),
    *(SampleColumn(facet.name, str, facet.class_of) for facet in FACETS if not facet.has_column),
)
