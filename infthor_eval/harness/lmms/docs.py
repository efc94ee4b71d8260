"""The docs of lmms-eval's tasks: questions of a packed set that are paired, on their clue frames.

The task files name functions by their full path: lmms-eval 0.7.3 executes a module beside a task
file anew for each function that it takes from it (`lmms_eval/utils.py:933`).
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

from infthor_eval.errors import DataError, InfthorError, UsageError
from infthor_eval.formats.frames import as_shown
from infthor_eval.formats.packed.tables import HINT, LocalStore, Shards
from infthor_eval.formats.question import WITHHELD, Question
from infthor_eval.grouping import grouped
from infthor_eval.nieh.contexts import DEFAULT_CONTEXT, context_named
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.prompts import question_text
from infthor_eval.storage.folders import packaged_folder

if TYPE_CHECKING:
    from datasets import Dataset

Doc = dict[str, Any]
OTHER = "answer_of_other"  # column that is added: the gold answers of the other question
_SET = "INFTHOR_SET"


def __getattr__(name: str) -> dict[str, list[str]]:
    """Return the data files of a task when it is loaded: `!function` takes any name of a module."""
    if name not in ("TWIN_FILES", "MOMENT_FILES"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with _ending_in_one_line():
        given = os.environ.get(_SET)
        if not given and name == "MOMENT_FILES":
            raise UsageError(f"no set of moments is in the package; set {_SET} to a packed one")
        return _files(Path(given) if given else packaged_folder("sets/nieh_mini_twins"))


@contextmanager
def _ending_in_one_line() -> Iterator[None]:
    """End the process with an error of ours: lmms-eval would try again, and say something else."""
    try:
        yield
    except InfthorError as error:
        raise SystemExit(f"infthor-eval: {error}") from error


def _files(folder: Path) -> dict[str, list[str]]:
    paths = sorted(folder.glob("questions-*-of-*.parquet"))
    if not paths:
        raise UsageError(
            f"{folder}: has no questions-*.parquet; set {_SET} to what infthor-eval pack wrote"
        )
    Shards("questions", LocalStore(folder)).check()
    return {"test": list(map(str, paths))}


def twin_docs(questions: "Dataset") -> "Dataset":
    """Return the questions that are paired across two worlds (`process_docs`)."""
    with _ending_in_one_line():
        return _paired(questions, True, "twins")


def moment_docs(questions: "Dataset") -> "Dataset":
    """Return the questions that are paired at two moments of a trajectory (`process_docs`)."""
    with _ending_in_one_line():
        return _paired(questions, False, "moments")


def _paired(questions: "Dataset", two_worlds: bool, kind: str) -> "Dataset":
    """Return the pairs of a kind, both questions of each in turn, with each other's answers.

    So `--limit` of an even number takes whole pairs.
    """
    rows = questions.select_columns(["pair", "traj_id", "answer", "gt_img_idx"]).to_list()
    by_pair = grouped((row["pair"], at) for at, row in enumerate(rows) if row["pair"])
    if odd := [pair for pair, both in by_pair.items() if len(both) != 2]:
        raise DataError(f"pair {odd[0]!r:.60} has not two questions; {HINT}")
    traj_ids = [row["traj_id"] for row in rows]
    pairs = [it for it in by_pair.values() if (traj_ids[it[0]] != traj_ids[it[1]]) == two_worlds]
    if not pairs:
        raise DataError(f"the set has no pairs of {kind}; set {_SET} to one that has, or make them")
    asked = list(chain.from_iterable(pairs))
    _check(questions, rows, asked)
    others: list[list[str]] = [[] for _ in rows]
    for one, two in chain(pairs, map(reversed, pairs)):
        others[one] = rows[two]["answer"]
    return questions.add_column(OTHER, others).select(asked)


def _check(questions: "Dataset", rows: Sequence[Doc], asked: Sequence[int]) -> None:
    """Refuse questions that lack frames or answers."""
    import pyarrow.compute as pc

    # Of the memory-mapped table: the pictures themselves are not read.
    n_frames = pc.list_value_length(questions.data["clue_frames"]).to_pylist()
    if lacking := [at for at in asked if n_frames[at] != len(rows[at]["gt_img_idx"])]:
        raise DataError(f"{len(lacking)} questions lack clue frames; pack a set that has them")
    if any(rows[at]["answer"] == [WITHHELD] for at in asked):
        raise DataError("the set's answers are withheld; give one that has its answers")


def doc_to_visual(doc: Doc) -> list[Image.Image]:
    """Return the clue frames in time order, as the context `clues` shows them."""
    numbered = zip(doc["gt_img_idx"], doc["clue_frames"], strict=True)
    return [as_shown(frame) for _, frame in sorted(numbered, key=itemgetter(0))]


def doc_to_text(doc: Doc) -> str:
    """Return the text that follows the frames."""
    return question_text(context_named(DEFAULT_CONTEXT).intro, _question(doc))


def doc_to_target(doc: Doc) -> str:
    """Return the gold answers as one reply would give them."""
    return doc_target(_question(doc))


def _question(doc: Doc) -> Question:
    return Question(doc["traj_id"], doc["question"], tuple(doc["gt_img_idx"]), tuple(doc["answer"]))
