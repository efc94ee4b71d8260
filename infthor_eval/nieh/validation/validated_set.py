"""The files of a validated set."""

import os
import shutil
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.nieh.validation.cross_validation import (
    JudgedQuestion,
    Verdicts,
    read_decisions,
    write_inspection_list,
)
from infthor_eval.storage.files import prepare_folder, write_atomically

INSPECTION = "inspection.csv"


def check_output(out: Path, data: NiehSet) -> None:
    """Refuse an output folder that the validated set would damage, before the models run.

    Raises:
        UsageError: it is the folder of the set itself, or the set has no `metadata/` to link.
        DataError: it has the frames of another set, or an inspection list that cannot be read.
    """
    if not (data.root / "metadata").is_dir():
        raise UsageError(
            f"{data.root}: has no metadata/, which a validated set links; give a set in the layout "
            "of the published one"
        )
    prepare_folder(out)
    if out.resolve() == data.root.resolve():
        raise UsageError(
            f"--out {out}: is the set itself, in which every question would be listed twice; give "
            "another"
        )
    link = out / "metadata"
    if os.path.lexists(link) and link.resolve() != (data.root / "metadata").resolve():
        raise DataError(f"{link}: holds the frames of another set; give another --out")
    if (out / INSPECTION).exists():
        read_decisions(out / INSPECTION)


def write_validated_set(out: Path, data: NiehSet, verdicts: Verdicts) -> Path | None:
    """Write the validated set into a folder, created if needed; its frames are linked, not copied.

    Returns:
        New path of an existing inspection list, if it has decisions that the new one has no rows
        for.

    Raises:
        DataError: a file cannot be written.
    """
    with wrap_errors(f"{out}: cannot be written", "give another --out"):
        out.mkdir(parents=True, exist_ok=True)
        link = out / "metadata"
        if not link.exists():
            link.symlink_to((data.root / "metadata").resolve(), target_is_directory=True)
        if (data.root / "set.json").is_file():
            shutil.copy(data.root / "set.json", out / "set.json")
        write_questions(out / "qa_set_validated.csv", [judged.question for judged in verdicts.kept])
        lines = [msgspec.json.encode(_as_json(judged)) for judged in verdicts.rejected]
        with write_atomically(out / "rejected.jsonl") as partial:
            partial.write_bytes(b"".join(line + b"\n" for line in lines))
        return write_inspection_list(out / INSPECTION, verdicts.to_inspect)


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
