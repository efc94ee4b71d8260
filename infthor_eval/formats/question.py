"""One NIEH question, as every room of the project passes it on."""

from dataclasses import dataclass
from functools import cached_property

from infthor_eval.formats.digests import digest

__all__ = ["ABSENCE", "Answer", "Question", "clue_column"]

Answer = str | int | float
ABSENCE = "absence"  # the column of questions that no frame proves


@dataclass(frozen=True)
class Question:
    """A question on one trajectory (one row of a `qa_set*.csv`).

    Attributes:
        traj_id: the trajectory's folder under `metadata/`.
        text: the question as put to the model.
        clues: frame numbers (`img_idx`) that hold the evidence, in the order of the file.
        answers: the gold answers; one, or several of which all are asked for.
        question_type: the question type where the file names one (a `question_type` column), else None.
        absence: whether the answer is that something is nowhere. No frame proves that: the clues are then a sample.
    """

    traj_id: str
    text: str
    clues: tuple[int, ...]
    answers: tuple[Answer, ...]
    question_type: str | None = None
    absence: bool = False

    @property
    def n_clues(self) -> int:
        """How many frames are evidence."""
        return 0 if self.absence else len(self.clues)

    @cached_property
    def id(self) -> str:
        """Name of the question, stable under reordering of the file: `<traj_id>/<12 hex digits>`."""
        key = repr((self.text, self.clues, self.answers))
        return f"{self.traj_id}/{digest(key, 6)}"


def clue_column(n_clues: int) -> str:
    """The column of the paper's Table 4 that a question with so many clues belongs to, or that of absences."""
    if n_clues == 0:
        return ABSENCE
    return str(n_clues) if n_clues < 3 else ">=3"
