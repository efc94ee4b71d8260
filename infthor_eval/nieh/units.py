"""The unit of NIEH: a question in one variant of its context, and how much evidence that shows."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from msgspec.structs import replace as replace_fields

from infthor_eval.nieh.contexts.base import QuestionVariant
from infthor_eval.nieh.guessing.blind import find_floor, visible_knowledge
from infthor_eval.nieh.records import BlindGuess, NiehAnswer, ShownClues
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.twins import twin_side
from infthor_eval.runs import Unit, UnitKey, UnitRecord


@dataclass(frozen=True)
class NiehUnit(Unit[NiehAnswer]):
    """A unit that asks the question of a sample.

    What `blind` says to the question is in its records, and not in `payload`: no question waits
    until it is learned.

    Attributes:
        sample: the sample.
        find_blind: returns what `blind` says to the question, or None.
    """

    sample: QuestionVariant
    find_blind: Callable[[], BlindGuess | None] = field(repr=False, compare=False)

    @classmethod
    def of(
        cls, task: str, task_samples: TaskSamples, sample: QuestionVariant, repeat: int = 1
    ) -> "NiehUnit":
        """Return the unit of a task's sample, with how much of its evidence is shown."""
        question = sample.question
        knowledge = visible_knowledge(task_samples.context_name)
        return cls(
            UnitKey(task, question.id, sample.variant, repeat),
            question.cluster,
            NiehAnswer.of(
                question,
                shown_clues=shown_clues(task_samples, sample),
                twin=twin_side(task_samples, sample),
            ),
            sample,
            lambda: find_floor(task_samples.data, knowledge).get(question.id),
        )

    def record(
        self, fingerprint: str, payload: NiehAnswer, **envelope: Any
    ) -> UnitRecord[NiehAnswer]:
        """See `Unit.record`."""
        return super().record(fingerprint, self._with_blind(payload), **envelope)

    def without_inputs(self) -> Unit[NiehAnswer]:
        """See `Unit.without_inputs`."""
        return Unit(self.key, self.cluster, self._with_blind(self.payload))

    def _with_blind(self, payload: NiehAnswer) -> NiehAnswer:
        return replace_fields(payload, blind=self.find_blind())


def shown_clues(task_samples: TaskSamples, sample: QuestionVariant) -> ShownClues | None:
    """Return the clue frames that a sample shows; None for absences and sets without frames.

    Blank frames and those of another home count as what they stand for; hidden ones do not.
    """
    data = task_samples.data
    question = sample.question
    if not question.has_evidence or not data.has_frames:
        return None
    clues = sorted(set(data.clue_positions(question)))
    positions = set(task_samples.positions(sample)) - task_samples.hidden(sample)
    n_after = len(data.frames_until(question)) - 1 - clues[-1]
    return ShownClues(
        n_shown=len(positions.intersection(clues)), n_clues=len(clues), n_after=n_after
    )
