"""What `validate` does: runs, verdicts, and the files of the validated set."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.cli.evaluate import execute_with_progress
from infthor_eval.cli.options import table_console
from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.scoring import Scorer
from infthor_eval.nieh.validation import Judged, Verdicts, judge, read_decisions, write_inspection_list
from infthor_eval.report import nieh_table, summarise, write_inspection_page
from infthor_eval.runs import RunOutcome, RunRequest, plan
from model_adapters import check_options

__all__ = ["validate"]

_output = table_console()


def validate(requests: Sequence[RunRequest], out: Path, decisions_file: Path | None, scorer: Scorer) -> int:
    """Run the models, sort the questions out, write the validated set, and print Table 4 on it.

    Args:
        requests: one per model, all on the clue frames of the same set.
        out: folder of the validated set; the runs lie in it too.
        decisions_file: an inspection list with decisions.
        scorer: under which an answer is correct.

    Returns:
        Exit code: 1 where a model failed on a question, else 0.
    """
    for request in requests:
        check_options(request.model, request.model_options)  # refused before the data are read
    decisions = read_decisions(decisions_file) if decisions_file else {}
    plans = [plan(request) for request in requests]
    work = plans[0].tasks[0].resolved
    data, questions = work.data, [question for question, _ in work.cases]
    outcomes = [execute_with_progress(ready) for ready in plans]
    replies = {request.model: _replies(outcome) for request, outcome in zip(requests, outcomes, strict=True)}
    verdicts = judge(questions, replies, decisions, scorer)
    _write_set(out, data, verdicts)
    _output.print(nieh_table([_on_kept(outcome, verdicts) for outcome in outcomes]))
    _output.print(
        f"{len(questions)} questions: {len(verdicts.kept)} kept, {len(verdicts.rejected)} rejected, "
        f"{len(verdicts.to_inspect)} to inspect: {out}",
        highlight=False,
    )
    return int(any(record.failure is not None for outcome in outcomes for record in outcome.records))


def _replies(outcome: RunOutcome) -> dict[str, str | None]:
    return {record.question_id: record.reply for record in outcome.records}


def _on_kept(outcome: RunOutcome, verdicts: Verdicts) -> dict[str, Any]:
    """The run's summary on the questions that stay."""
    kept = {item.question.id for item in verdicts.kept}
    return summarise(outcome.identity, [record for record in outcome.records if record.question_id in kept])


def _write_set(out: Path, data: NiehSet, verdicts: Verdicts) -> None:
    """The validated set, whole enough to be evaluated: its frames stay where they are, linked."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        link = out / "metadata"
        if not link.exists():
            link.symlink_to((data.root / "metadata").resolve(), target_is_directory=True)
        if (data.root / "set.json").is_file():
            shutil.copy(data.root / "set.json", out / "set.json")
        write_questions(out / "qa_set_validated.csv", [item.question for item in verdicts.kept])
        lines = [msgspec.json.encode(_as_json(item)) for item in verdicts.rejected]
        (out / "rejected.jsonl").write_bytes(b"".join(line + b"\n" for line in lines))
        write_inspection_list(out / "inspection.csv", verdicts.to_inspect)
        write_inspection_page(out / "inspection.html", verdicts.to_inspect, data)
    except OSError as error:
        raise DataError(f"{out}: cannot be written ({error.strerror}); give another --out") from error


def _as_json(item: Judged) -> dict[str, Any]:
    question = item.question
    return {
        "question_id": question.id,
        "traj_id": question.traj_id,
        "question": question.text,
        "gt_img_idx": question.clues,
        "answer": question.answers,
        "question_type": question.question_type,
        "replies": item.replies,
        "decision": item.decision,
    }
