"""The question sets of runs, as far as they are there and unchanged."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import find_set
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[NiehAnswer]


class RunSets:
    """The sets of the tasks of some runs.

    Attributes:
        problems: reason why a task has no set, by its name.
    """

    def __init__(self, runs: Sequence[Run], data: Path | None) -> None:
        """Open the sets; `data` is the folder of all, None for the one that each run names."""
        self.problems: dict[str, str] = {}
        self._sets: dict[str, tuple[NiehSet, Mapping[str, Question]]] = {}
        for run in runs:
            for task in run.tasks:
                if task not in self._sets and task not in self.problems:
                    self._open(run, task, data)

    def find_set(self, task: str) -> NiehSet | None:
        """Return the set of a task; None if it is missing or has changed."""
        return self._sets[task][0] if task in self._sets else None

    def find_question(self, key: UnitKey, record: Record) -> Question | None:
        """Return the question of a record; None if its set is missing or has another one there."""
        question = self._sets[key.task][1].get(key.id) if key.task in self._sets else None
        return (
            question if question is not None and question.text == record.payload.question else None
        )

    def _open(self, run: Run, task: str, data: Path | None) -> None:
        folder = data or run.data
        options = run.stored_command.options if run.stored_command else {}
        try:
            opened = find_set(
                str(folder) if folder else None,
                run.tasks[task].dataset_kwargs.get("bundled"),
                options.get("trajectories"),
            )
        except (UsageError, DataError) as error:
            self.problems[task] = f"{error}; give the set's folder with --data"
            return
        if opened.fingerprint != run.tasks[task].data:
            self.problems[task] = f"{opened.root} has changed since {run.label} was run"
            return
        self._sets[task] = opened, {question.id: question for question in opened.questions}
