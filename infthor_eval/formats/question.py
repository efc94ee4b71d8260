"""One NIEH question, the type that all packages of the project share."""

from dataclasses import dataclass
from functools import cached_property

from infthor_eval.formats.digests import digest

__all__ = ["ABSENCE", "Answer", "Question", "clue_column"]

Answer = str | int | float
ABSENCE = "absence"  # column of the absence questions (no frame is evidence)


@dataclass(frozen=True)
class Question:
    """A question on one trajectory (one row of a `qa_set*.csv`).

    Attributes:
        traj_id: name of the trajectory's folder under `metadata/`.
        text: question as shown to the model.
        clues: numbers (`img_idx`) of the frames with the evidence, in the order of the file.
        answers: gold answers; if there are several, all are required.
        question_type: content of the `question_type` column, or None if the file has none.
        absence: True if the answer is that something is nowhere. No frame is evidence; the clues are a sample.
    """

    traj_id: str
    text: str
    clues: tuple[int, ...]
    answers: tuple[Answer, ...]
    question_type: str | None = None
    absence: bool = False

    @property
    def n_clues(self) -> int:
        """Number of frames that are evidence."""
        return 0 if self.absence else len(self.clues)

    @cached_property
    def id(self) -> str:
        """Name of the question, which does not depend on the order of the file: `<traj_id>/<12 hex digits>`."""
        key = repr((self.text, self.clues, self.answers))
        return f"{self.traj_id}/{digest(key, 6)}"


def clue_column(n_clues: int) -> str:
    """Return the column for questions with this number of clues (paper, Table 4), or the column of absences."""
    if n_clues == 0:
        return ABSENCE
    return str(n_clues) if n_clues < 3 else ">=3"
