"""The files of a validated set."""

import shutil
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.validation import Judged, Verdicts, write_inspection_list

__all__ = ["write_validated_set"]


def write_validated_set(out: Path, data: NiehSet, verdicts: Verdicts) -> None:
    """Write a set that is whole enough to be evaluated: its frames stay where they are, linked.

    Args:
        out: folder of the set; made where it does not exist.
        data: the set that was validated.
        verdicts: what became of its questions.

    Raises:
        DataError: it cannot be written.
    """
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
