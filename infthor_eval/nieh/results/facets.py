"""By what questions are grouped: their form, what was shown of their evidence, their length.

To add a facet of questions: an entry in `FACETS`; it is then in results.json, in the tables, on the
page, in the table of samples, and in exports.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from infthor_eval.distances import AGES, DISTANCES, LENGTHS, age_class, distance_class, length_class
from infthor_eval.facets import Facet
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]

DEPTH = "depth="  # what the variants of tasks with depths begin with
SHOWN_CLUES = ("all", "some", "none")
_WORDS = (4, 8, 12, 16)  # most words of a question in each class
N_WORDS = ("1-4", "5-8", "9-12", "13-16", ">16")


def _several(_: str, classes: Collection[str]) -> bool:
    return len(classes) > 1


@dataclass(frozen=True)
class QuestionFacet(Facet[Record]):
    """A facet of questions.

    Attributes:
        title: what the classes are of, in the heading of its table; "" for `heading`.
        has_column: whether samples show the class already, in a column of another name.
        of_files: whether the questions of each file are grouped too.
        has_all: whether tables and charts have all classes, with those of no question.
        in_tables: whether it has a table of its own.
        in_charts: whether it has a chart of its own.
        is_worth: whether a task's classes are worth a table, by its context and their names.
    """

    title: str = ""
    has_column: bool = False
    of_files: bool = False
    has_all: bool = False
    in_tables: bool = True
    in_charts: bool = True
    is_worth: Callable[[str, Collection[str]], bool] = _several

    def shown(self, used: Collection[str]) -> list[str]:
        """Return the classes that tables and charts have, by those that are used."""
        return list(self.classes) if self.has_all else self.in_order(used)


def _file(record: Record) -> str | None:
    return record.payload.file or None


def _share_shown(record: Record) -> str | None:
    clues = record.payload.shown_clues
    if clues is None:
        return None
    return SHOWN_CLUES[0 if clues.n_shown == clues.n_clues else 1 if clues.n_shown else 2]


def _distance(record: Record) -> str | None:
    clues = record.payload.shown_clues
    return None if clues is None or clues.n_after is None else distance_class(clues.n_after)


def _age(record: Record) -> str | None:
    twin = record.payload.twin
    is_placebo = twin is not None and twin.answers == record.payload.answers
    return None if twin is None or twin.age is None or is_placebo else age_class(twin.age)


def _length(record: Record) -> str | None:
    tokens = record.tokens.context
    return None if tokens is None else length_class(tokens)


def _words(record: Record) -> str:
    n_words = len(record.payload.question.split())
    return N_WORDS[sum(n_words > most for most in _WORDS)]


FILE = QuestionFacet(
    "file", "question file", _file, has_column=True, in_tables=False, in_charts=False
)
LENGTH = QuestionFacet(
    "length",
    "length of the context, thousand tokens",
    _length,
    LENGTHS,
    has_column=True,
    in_tables=False,
)
FACETS = (
    QuestionFacet(
        "question_type",
        "type of question",
        lambda record: record.payload.question_type or "untyped",
        has_column=True,
        in_tables=False,
    ),
    # Its table and its chart are of depths alone.
    QuestionFacet(
        "variant",
        "depth of the needle",
        lambda record: record.variant or "-",
        has_column=True,
        in_tables=False,
        in_charts=False,
    ),
    FILE,
    LENGTH,
    QuestionFacet(
        "shown_clues",
        "clue frames shown",
        _share_shown,
        SHOWN_CLUES,
        title="how many of the clue frames were shown",
        has_column=True,
        of_files=True,
        has_all=True,
        is_worth=lambda _, classes: bool(set(classes) - {"all"}),
    ),
    QuestionFacet(
        "distance",
        "frames between the last clue and the end",
        _distance,
        DISTANCES,
        title="frames between the last clue and the end of the trajectory",
        has_column=True,
        of_files=True,
        is_worth=lambda context, classes: bool(classes) and context != "clues",
    ),
    # Beside the net pairs of twins.
    QuestionFacet(
        "age", "frames since the newest evidence", _age, AGES, has_column=True, in_charts=False
    ),
    QuestionFacet("words", "words of the question", _words, N_WORDS),
)
