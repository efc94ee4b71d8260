"""Cross-validation of questions (paper, A.1.3): a filter over several models' replies to clues.

A question is kept if at least one model answers it correctly: with full marks by default, with any
part of them in the published filter (of its 829 questions with one clue 20 have partial credit
alone). One with several clues that no model answers may still be a good, hard question: a person
inspects it and decides. All others are rejected.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.csv_files import read_rows, unshield, write_sheet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.scoring import Scorer, scores

DECISIONS = ("keep", "drop")
_COLUMNS = ("question_id", "traj_id", "question", "gt_img_idx", "answer", "replies", "decision")


@dataclass(frozen=True)
class JudgedQuestion:
    """A question and the models' replies to it.

    Attributes:
        replies: reply of each model; None where the model failed.
        right: names of the models that answered it correctly.
        decision: a person's decision, "keep" or "drop"; None if there is none.
    """

    question: Question
    replies: Mapping[str, str | None]
    right: tuple[str, ...]
    decision: str | None = None


@dataclass
class Verdicts:
    """The judged questions.

    Attributes:
        kept: questions that at least one model answered correctly, or that a person decided to
            keep.
        rejected: questions that no model answered correctly, with one clue, or that a person
            decided to drop.
        to_inspect: questions with several clues that no model answered correctly, without a
            decision.
    """

    kept: list[JudgedQuestion] = field(default_factory=list)
    rejected: list[JudgedQuestion] = field(default_factory=list)
    to_inspect: list[JudgedQuestion] = field(default_factory=list)

    def add(self, judged: JudgedQuestion) -> None:
        """Add a question to the list that it belongs to."""
        if judged.right:
            self.kept.append(judged)
        elif len(judged.question.clues) == 1:
            self.rejected.append(judged)
        else:
            {"keep": self.kept, "drop": self.rejected, None: self.to_inspect}[
                judged.decision
            ].append(judged)


def judge_questions(
    questions: Sequence[Question],
    replies: Mapping[str, Mapping[str, str | None]],
    decisions: Mapping[str, str],
    scorer: Scorer = "strict",
    *,
    partial_credit: bool = False,
) -> Verdicts:
    """Judge questions by the replies of models.

    Args:
        questions: the questions in the order of the set.
        replies: replies by model, then by question id; None where the model failed.
        decisions: "keep" or "drop", by question id.
        scorer: scorer whose full marks are a correct answer.
        partial_credit: whether any part of them is one already, as in the published filter.

    Raises:
        DataError: a model was not asked one of the questions, or a decision is about a question of
            another set.
    """
    check_decisions(decisions, questions)
    verdicts = Verdicts()
    for question in questions:
        by_model = {model: _reply(question, model, of_model) for model, of_model in replies.items()}
        of_models = {
            m: scores(t, question.answers)[scorer] for m, t in by_model.items() if t is not None
        }
        right = judge_scores(of_models, partial_credit=partial_credit)
        judged = JudgedQuestion(question, by_model, right, decisions.get(question.id))
        verdicts.add(judged)
    return verdicts


def judge_scores(scores: Mapping[str, float], *, partial_credit: bool) -> tuple[str, ...]:
    """Return the names of the models whose score of a question counts as a correct answer."""
    return tuple(
        model for model, value in scores.items() if value >= 1.0 or (partial_credit and value > 0.0)
    )


def check_decisions(decisions: Mapping[str, str], questions: Iterable[Question]) -> None:
    """Refuse decisions on another set.

    Raises:
        DataError: a decision is about a question that is not in the set.
    """
    unknown = sorted(set(decisions) - {question.id for question in questions})
    if unknown:
        raise DataError(
            f"the decisions are about {unknown[0]}, which is not in the set; take the list of this "
            "set"
        )


def _reply(question: Question, model: str, replies: Mapping[str, str | None]) -> str | None:
    if question.id not in replies:
        raise DataError(f"model {model} was not asked {question.id}; run it on the whole set")
    return replies[question.id]


def write_inspection_list(path: Path, items: Iterable[JudgedQuestion]) -> Path | None:
    """Write the questions for a person to decide on, who fills the last column: keep or drop.

    Decisions in an existing list are kept. A list with decisions on other questions is renamed, and
    its new path is returned; else None.

    Raises:
        DataError: an existing list cannot be read.
        OSError: the list cannot be written.
    """
    earlier = read_decisions(path) if path.exists() else {}
    listed = list(items)
    renamed = None
    if earlier.keys() - {judged.question.id for judged in listed}:
        names = (
            path.with_name(f"{path.stem}.{number}{path.suffix}") for number in itertools.count(1)
        )
        renamed = path.rename(next(name for name in names if not name.exists()))
    write_sheet(
        path, _COLUMNS, (_row(judged, earlier.get(judged.question.id, "")) for judged in listed)
    )
    return renamed


def _row(judged: JudgedQuestion, decision: str) -> list[object]:
    question = judged.question
    replies = "; ".join(f"{model}: {text}" for model, text in judged.replies.items())
    clues = list(question.clues)
    answers = list(question.answers)
    return [question.id, question.traj_id, question.text, clues, answers, replies, decision]


def read_decisions(path: Path) -> dict[str, str]:
    """Read an inspection list that a person has filled; rows without a decision are ignored.

    Raises:
        DataError: the file cannot be read, lacks a column, or a decision is neither keep nor drop.
    """
    decisions: dict[str, str] = {}
    hint = "fill the list that `validate` wrote"
    for row in read_rows(path, ("question_id", "decision"), hint, line_breaks=True):
        where = f"{path}, line {row.line}"
        if row.problem is not None:
            raise DataError(f"{where}: {row.problem}")
        name = unshield(row.cells["question_id"])
        decision = row.cells["decision"].strip().lower()
        if decision and decision not in DECISIONS:
            raise DataError(f"{where}: decision is {decision!r:.60}; write keep or drop")
        if decisions.get(name, decision) != decision:
            raise DataError(f"{where}: {name} has another decision above; remove one of the rows")
        if decision:
            decisions[name] = decision
    return decisions
