"""Cross-validation of questions (paper, A.1.3): a filter over several models' replies to clues.

A question is kept if at least one model answers it correctly: with full marks by default, with any
part of them in the published filter (of its 829 questions with one clue 20 have partial credit
alone). One with several clues that no model answers may still be a good, hard question: a person
inspects it and decides. All others are rejected.
"""

import itertools
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.csv_files import read_rows, unshield, write_sheet
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.paths import frame_sources
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.nieh.scoring import Scorer, scores
from infthor_eval.storage.files import prepare_folder, write_atomically

DECISIONS = ("keep", "drop")
_COLUMNS = ("question_id", "traj_id", "question", "gt_img_idx", "answer", "replies", "decision")
_INSPECTION = "inspection.csv"


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
    """Refuse decisions on another set."""
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
    """Read an inspection list that a person has filled; rows without a decision are ignored."""
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


def check_output(out: Path, data: NiehSet) -> None:
    """Refuse an output folder that the validated set would damage, before the models run."""
    if not (sources := frame_sources(data.root)):
        raise UsageError(
            f"{data.root}: has no metadata/, which a validated set links; give a set in the layout "
            "of the published one, or a packed one"
        )
    prepare_folder(out)
    if out.resolve() == data.root.resolve():
        raise UsageError(
            f"--out {out}: is the set itself, in which every question would be listed twice; give "
            "another"
        )
    for source in sources:
        link = out / source.name
        if os.path.lexists(link) and link.resolve() != source.resolve():
            raise DataError(f"{link}: holds the frames of another set; give another --out")
    if (out / _INSPECTION).exists():
        read_decisions(out / _INSPECTION)


def write_validated_set(out: Path, data: NiehSet, verdicts: Verdicts) -> Path | None:
    """Write the validated set into a folder, created if needed; its frames are linked, not copied.

    Returns:
        New path of an existing inspection list, if it has decisions that the new one has no rows
        for.
    """
    with wrap_errors(f"{out}: cannot be written", "give another --out"):
        out.mkdir(parents=True, exist_ok=True)
        for source in frame_sources(data.root):
            link = out / source.name
            if not link.exists():
                link.symlink_to(source.resolve(), target_is_directory=source.is_dir())
        if (data.root / "set.json").is_file():
            shutil.copy(data.root / "set.json", out / "set.json")
        write_questions(out / "qa_set_validated.csv", [judged.question for judged in verdicts.kept])
        lines = [msgspec.json.encode(_as_json(judged)) for judged in verdicts.rejected]
        with write_atomically(out / "rejected.jsonl") as partial:
            partial.write_bytes(b"".join(line + b"\n" for line in lines))
        return write_inspection_list(out / _INSPECTION, verdicts.to_inspect)


def _as_json(judged: JudgedQuestion) -> dict[str, Any]:
    question = judged.question
    return {
        "question_id": question.id,
        "traj_id": question.traj_id,
        "question": question.text,
        "gt_img_idx": question.clues,
        "answer": question.answers,
        "question_type": question.question_type,
        "replies": judged.replies,
        "decision": judged.decision,
    }
