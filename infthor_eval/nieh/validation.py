"""Cross-validation of questions (paper, A.1.3): a filter over the replies of several models to the clue frames.

A question stays if at least one model answers it correctly. One with several clues that none answers may still be a
good, hard question: a person looks at it and decides. The rest is rejected.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.csv_files import read_rows, unshield, write_sheet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import Scorer, score

__all__ = ["DECISIONS", "Judged", "Verdicts", "check_decisions", "judge", "read_decisions", "write_inspection_list"]

DECISIONS = ("keep", "drop")
_COLUMNS = ("question_id", "traj_id", "question", "gt_img_idx", "answer", "replies", "decision")


@dataclass(frozen=True)
class Judged:
    """A question and what the models said to it.

    Attributes:
        question: the question.
        replies: reply by model; None where the model failed.
        right: the models that answered it correctly.
        decision: what a person decided, "keep" or "drop"; None where nobody has.
    """

    question: Question
    replies: Mapping[str, str | None]
    right: tuple[str, ...]
    decision: str | None = None


@dataclass
class Verdicts:
    """The questions, sorted out.

    Attributes:
        kept: at least one model was right, or a person decided to keep it.
        rejected: no model was right, and one clue makes it or a person decided to drop it.
        to_inspect: several clues, no model right, nobody has decided.
    """

    kept: list[Judged] = field(default_factory=list)
    rejected: list[Judged] = field(default_factory=list)
    to_inspect: list[Judged] = field(default_factory=list)


def judge(
    questions: Sequence[Question],
    replies: Mapping[str, Mapping[str, str | None]],
    decisions: Mapping[str, str],
    scorer: Scorer = "strict",
) -> Verdicts:
    """Sort questions out.

    Args:
        questions: in the order in which they are to stay.
        replies: model to question id to reply; None where the model failed.
        decisions: question id to "keep" or "drop", for questions that were inspected.
        scorer: full marks under it are a correct answer.

    Raises:
        DataError: a model was not asked one of the questions, or a decision is about a question that is not there.
    """
    check_decisions(decisions, questions)
    verdicts = Verdicts()
    for question in questions:
        said = {model: _reply(question, model, found) for model, found in replies.items()}
        right = tuple(m for m, text in said.items() if text is not None and _correct(text, question, scorer))
        judged = Judged(question, said, right, decisions.get(question.id))
        _place(judged, verdicts).append(judged)
    return verdicts


def check_decisions(decisions: Mapping[str, str], questions: Iterable[Question]) -> None:
    """Refuse decisions that are about another set.

    Raises:
        DataError: one is about a question that is not there.
    """
    unknown = sorted(set(decisions) - {question.id for question in questions})
    if unknown:
        raise DataError(f"the decisions are about {unknown[0]}, which is not in the set; take the list of this set")


def _place(judged: Judged, verdicts: Verdicts) -> list[Judged]:
    if judged.right:
        return verdicts.kept
    if len(judged.question.clues) == 1:
        return verdicts.rejected
    return {"keep": verdicts.kept, "drop": verdicts.rejected, None: verdicts.to_inspect}[judged.decision]


def _reply(question: Question, model: str, found: Mapping[str, str | None]) -> str | None:
    if question.id not in found:
        raise DataError(f"model {model} was not asked {question.id}; run it on the whole set")
    return found[question.id]


def _correct(text: str, question: Question, scorer: Scorer) -> bool:
    return score(last_line(text), question.answers, scorer) >= 1.0


def write_inspection_list(path: Path, items: Iterable[Judged]) -> Path | None:
    """Write the questions that a person must decide on; the last column is to be filled with keep or drop.

    What was filled in already, in a list that is there, is taken over; a list with decisions on other questions is kept
    under another name.

    Returns:
        Where the earlier list is kept; None where nothing of it would be lost.

    Raises:
        DataError: the list that is there cannot be read.
        OSError: the list cannot be written.
    """
    earlier = read_decisions(path) if path.exists() else {}
    listed = list(items)
    kept = None
    if earlier.keys() - {item.question.id for item in listed}:
        names = (path.with_name(f"{path.stem}.{number}{path.suffix}") for number in itertools.count(1))
        kept = path.rename(next(name for name in names if not name.exists()))
    write_sheet(path, _COLUMNS, (_row(item, earlier.get(item.question.id, "")) for item in listed))
    return kept


def _row(item: Judged, decision: str) -> list[object]:
    question = item.question
    said = "; ".join(f"{model}: {text}" for model, text in item.replies.items())
    clues, answers = list(question.clues), list(question.answers)
    return [question.id, question.traj_id, question.text, clues, answers, said, decision]


def read_decisions(path: Path) -> dict[str, str]:
    """Read an inspection list that a person has filled; rows without a decision are left open.

    Raises:
        DataError: the file cannot be read, lacks a column, or a decision is neither keep nor drop.
    """
    decisions: dict[str, str] = {}
    mend = "fill the list that `validate` wrote"
    for place, row in read_rows(path, ("question_id", "decision"), mend, line_breaks=True):
        name, decision = unshield(row["question_id"]), row["decision"].strip().lower()
        if decision and decision not in DECISIONS:
            raise DataError(f"{place}: decision is {decision!r:.60}; write keep or drop")
        if decisions.get(name, decision) != decision:
            raise DataError(f"{place}: {name} is decided otherwise above; take one of the rows out")
        if decision:
            decisions[name] = decision
    return decisions
