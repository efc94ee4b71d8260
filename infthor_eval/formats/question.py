"""One NIEH question, the type that all packages of the project share."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from infthor_eval.storage.digests import digest

Answer = str | int | float
WITHHELD = "(withheld)"  # in place of the gold answers, in the public part of a private set
ABSENCE = "absence"  # column of the absence questions (no frame is evidence)


@dataclass(frozen=True)
class PublishedColumns:
    """What only the published files say of a question; None or empty where a column is missing.

    Attributes:
        file: the file that it is in: the one of a single clue or the one of several.
        qid: its name.
        n_evidence: `num_evidence`, pieces of evidence as the published scripts count them.
        steps: `gt_steps`, the steps that its clues belong to.
        matches: scores on the clue frames by column, `match1` (LLaVA-OneVision), `match2`
            (Pixtral), `match3` (Qwen2.5-VL) and `match4` (DeepSeek-VL).
    """

    file: Literal["single", "multi"]
    qid: str | None = None
    n_evidence: int | None = None
    steps: tuple[int, ...] = ()
    matches: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Question:
    """A question on one trajectory (one row of a `qa_set*.csv`).

    Attributes:
        traj_id: name of the trajectory's folder under `metadata/`.
        text: question as shown to the model.
        clues: numbers (`img_idx`) of the frames with the evidence, in the order of the file.
        answers: gold answers; if there are several, all are required.
        question_type: content of the `question_type` column, or None if the file has none.
        absence: True if the answer is that something is nowhere. No frame is evidence; the clues
            are a sample.
        moment: number (`img_idx`) of the frame after which it is asked: no later one is shown. None
            for the end of the trajectory.
        published: further columns of a published file; None elsewhere.
        pair: name of the pair of questions that it is one of, in twins; empty elsewhere.
        fact: name of the changed fact that the pair is about; several pairs may be about one.
        base: name of the trajectory that both worlds of a pair were made of; empty elsewhere.
        file: name of its file without suffix, among several of a set; empty elsewhere. It is no
            part of what is asked.
    """

    traj_id: str
    text: str
    clues: tuple[int, ...]
    answers: tuple[Answer, ...]
    question_type: str | None = None
    absence: bool = False
    moment: int | None = None
    published: PublishedColumns | None = None
    pair: str = field(default="", compare=False)
    fact: str = field(default="", compare=False)
    base: str = field(default="", compare=False)
    file: str = field(default="", compare=False)

    @property
    def n_clues(self) -> int:
        """Number of frames that are evidence."""
        return 0 if self.absence else len(self.clues)

    @property
    def clue_column(self) -> str:
        """The question's column in the paper's Table 4, `ABSENCE`, or empty if only in the total.

        Columns count clue frames, not steps. Two published files make one exception: "1" is the
        whole file of a single clue, and a question of the other file with one frame is in the total
        alone.
        """
        file = self.published.file if self.published else None
        if self.n_clues == 0:
            return ABSENCE
        if file == "single" or self.n_clues == 1:
            return "" if file == "multi" else "1"
        return "2" if self.n_clues == 2 else ">=3"

    @property
    def is_withheld(self) -> bool:
        """True if its gold answers are secret (`answer_key`): no reply to it has a score."""
        return self.answers == (WITHHELD,)

    @property
    def has_evidence(self) -> bool:
        """True if its clues are shown as evidence: not of an absence, but of both of twins."""
        return bool(self.pair) or not self.absence

    @property
    def draw_name(self) -> str:
        """Name by which frames are drawn for it: the same in both worlds of twins."""
        return self.pair or self.id

    @property
    def place(self) -> tuple[str, float]:
        """What questions are sorted by to be asked in order: trajectory, and moment in it."""
        return self.traj_id, math.inf if self.moment is None else self.moment

    @property
    def cluster(self) -> str:
        """Name of what intervals cluster by: its trajectory, or the base of twins."""
        return self.base or self.traj_id

    @cached_property
    def id(self) -> str:
        """Name of the question, whatever the file's order: `<traj_id>/<12 hex digits>`, or qid."""
        # A few published questions are there twice, under two names.
        if self.published and self.published.qid:
            return self.published.qid
        asked = (self.text, self.clues, self.answers)
        key = repr(asked if self.moment is None else (*asked, self.moment))
        return f"{self.traj_id}/{digest(key, 6)}"


@dataclass(frozen=True)
class SkippedQuestion:
    """A question that cannot be asked, and why; in all variants if `variant` is empty."""

    question: Question
    reason: str
    variant: str = ""
