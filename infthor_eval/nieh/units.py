"""The unit of NIEH: a question in one variant of its context."""

from dataclasses import dataclass

from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.guessing.guesses import find_guesses, visible_knowledge
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.shown_clues import shown_clues
from infthor_eval.runs import Unit, UnitKey

__all__ = ["NiehUnit"]


@dataclass(frozen=True)
class NiehUnit(Unit[NiehAnswer]):
    """A unit that asks the question of a sample."""

    sample: Sample

    @classmethod
    def of(cls, task: str, task_samples: TaskSamples, sample: Sample, repeat: int = 1) -> "NiehUnit":
        """Return the unit of a task's sample, with what can be guessed of it and how much of its evidence is shown."""
        question = sample.question
        guesses = find_guesses(task_samples.data, visible_knowledge(task_samples.context_name))
        payload = NiehAnswer.of(question, guesses.get(question.id), shown_clues(task_samples, sample))
        return cls(UnitKey(task, question.id, sample.variant, repeat), question.traj_id, payload, sample)
