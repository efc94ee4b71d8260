"""The public part of a private set: frames, and questions without answers.

Names and order are drawn from the secret, and nothing else that the simulator logged is in it.
"""

import os
from collections.abc import Mapping
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import WITHHELD, Question
from infthor_eval.formats.replies.answer_key import write_key
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.generation.private.secrets import Secret
from infthor_eval.storage.files import prepare_folder

__all__ = ["publish"]

_DIGITS = 16  # of public names
_TIME = 946_684_800  # of all public files: 1 January 2000, in seconds since 1970
_QUESTIONS = "qa_set_private.csv"


def publish(data: NiehSet, secret: Secret, public: Path) -> Path:
    """Write the public part of a set of twins, and the key beside the set; return the folder.

    The public part has of each trajectory the frames alone, and of each question its words, type
    and clues, which are the same in both worlds. Pairs are not named.

    Raises:
        DataError: the folder is there already, or a frame cannot be read.
    """
    if public.exists() and any(public.iterdir()):
        raise DataError(f"{public}: is there already; move it away, or give another --out")
    prepare_folder(public)
    claim_for_simulator(public, data.simulator or "embedded")
    by_name = {
        traj_id: f"t{secret.digest(f'name {traj_id}')[:_DIGITS]}"
        for traj_id in {question.traj_id for question in data.questions}
    }
    # In the order of the public names: not even the order in which files were made tells.
    for traj_id, name in sorted(by_name.items(), key=lambda item: item[1]):
        _publish_frames(data, traj_id, public, name)
    questions = {
        question: _without_answers(question, by_name[question.traj_id])
        for question in data.questions
    }
    ids = _ids(questions)
    order = sorted(questions.values(), key=lambda question: secret.digest(f"order {question.id}"))
    write_questions(public / _QUESTIONS, order)
    _hide_times(public)
    write_key(data.directory, NiehSet(public), ids)
    return public


def _ids(questions: Mapping[Question, Question]) -> dict[str, str]:
    ids = {public.id: question.id for question, public in questions.items()}
    if len(ids) < len(questions):
        raise DataError("two questions are the same but for their answers; make the twins again")
    return ids


def _without_answers(question: Question, name: str) -> Question:
    return Question(
        name, question.text, tuple(sorted(question.clues)), (WITHHELD,), question.question_type
    )


def _publish_frames(data: NiehSet, traj_id: str, public: Path, name: str) -> None:
    folder = public / "metadata" / name
    folder.mkdir(parents=True)
    names = []
    steps = []
    for index, frame in enumerate(data.frames(traj_id)):
        if frame.patches:
            raise DataError(f"{data.root}: its pictures are patched; make the twins again")
        names.append(store_picture(public, frame.path, "private-set"))
        steps.append({"img_idx": index, "img_filename": f"{index:09d}.png", "step": index})
    write_frame_names(folder, names)
    logged = [{**step, "object_log": {}} for step in steps]
    (folder / "metadata.json").write_bytes(msgspec.json.encode(logged) + b"\n")


def _hide_times(public: Path) -> None:
    """Give all files one time, so that no order shows in which worlds were made."""
    for path in sorted(public.rglob("*"), reverse=True):
        os.utime(path, (_TIME, _TIME))
    os.utime(public, (_TIME, _TIME))
