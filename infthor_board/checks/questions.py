"""All questions of the set there, once, and none of another."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from infthor_board.case import Case, count
from infthor_board.expected import Expected
from infthor_board.reading import Problem
from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.scoring import plain_form
from infthor_eval.storage.digests import canonical_json


class SameSet:
    """The run is on the checker's set, byte for byte."""

    name: ClassVar[str] = "set"
    reason: ClassVar[str] = "scores on another set, or an edited one, are not comparable"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.tasks:
            if task.config is None:
                continue
            theirs = task.run.header.config.tasks[task.name]
            if theirs.data != task.config.data:
                yield Problem(
                    self.name,
                    f"{task.name}: was asked on a set with fingerprint {theirs.data[:12]}; that of "
                    f"{task.data.root.name} is {task.config.data[:12]}; run it on that set",
                )


class SameTask:
    """The task is the installed one of its name: context, words of the question, limits."""

    name: ClassVar[str] = "task"
    reason: ClassVar[str] = "an easier task under a harder one's name"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.tasks:
            if task.config is None:
                continue
            theirs = task.run.header.config.tasks[task.name]
            ours = task.config
            differing = [
                name
                for name in ("dataset_kwargs", "doc_to_text", "doc_to_image", "process_docs")
                if theirs.settings.get(name) != ours.settings.get(name)
            ]
            # Ours are without those of a memory or a retriever, which is not loaded here.
            if not ours.sources.keys() <= theirs.sources.keys() or theirs.film != ours.film:
                differing.append("sources")
            if differing:
                yield Problem(
                    self.name,
                    f"{task.name}: has other {', '.join(differing)} than the installed task; run "
                    "the installed one",
                )


class AllThere:
    """Every question of the set has a record: none missing, left out, or not asked."""

    name: ClassVar[str] = "complete"
    reason: ClassVar[str] = "leaving out hard questions raises a score"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        if case.tasks and not case.shown:
            yield self._problem("all its runs are controls; send the one with the set's own frames")
        for task in case.tasks:
            yield from map(self._problem, self._reasons(task))

    def _problem(self, text: str) -> Problem:
        return Problem(self.name, text)

    def _reasons(self, task: Expected) -> Iterator[str]:
        limit = task.run.header.config.limit
        if limit is not None:
            yield f"{task.name}: was run with --limit {limit}; run it whole"
        if task.config is not None:
            ours = {(it.question_id, it.variant) for it in task.config.skipped}
            skipped = task.run.header.config.tasks[task.name].skipped
            left_out = [
                it.question_id for it in skipped if (it.question_id, it.variant) not in ours
            ]
            if left_out:
                yield (
                    f"{task.name}: leaves out {count('questions', left_out)} that can be asked; "
                    "run it again"
                )
        states = {record.key: record.state for record in task.records}
        for state, what in (("not asked", "were not asked"), ("excluded", "are excluded")):
            keys = [str(key) for key, its in states.items() if its == state]
            if keys:
                yield f"{task.name}: {count('questions', keys)} {what}; resume the run"
        missing = [str(key) for key in task.units if key not in states]
        if missing:
            yield (
                f"{task.name}: {count('questions', missing)} of {len(task.units):,} are missing; "
                "resume the run"
            )


class AskedOnce:
    """No question has two results."""

    name: ClassVar[str] = "once"
    reason: ClassVar[str] = "asking until the answer is right is not one answer"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`; two equal results are one that two workers had."""
        names = Counter(_run_settings(task) for task in case.tasks)
        for (task, *_), n in names.items():
            if n > 1:
                yield Problem(
                    self.name,
                    f"{task}: {n} runs with the same settings; send one, or ask with --repeats",
                )
        for run in case.submission.runs:
            replies: dict[Any, set[str]] = {}
            for record in run.results:
                said = plain_form(record.payload.reply or "")
                if record.failure is None:
                    replies.setdefault(record.key, set()).add(said)
            twice = [str(key) for key, said in replies.items() if len(said) > 1]
            if twice:
                yield Problem(
                    self.name,
                    f"{run.path.name}: {count('questions', twice)} were answered twice, and not "
                    "the same; send a run that asks once",
                )
            again = [text for text in run.unread if "again" in text]
            if again:
                yield Problem(self.name, f"{run.path.name}: {count('rows', again)}; give each once")


def _run_settings(task: Expected) -> tuple[str, ...]:
    """Return task, context, frames and memory, of which a submission has one run each."""
    config = task.run.header.config
    kwargs = canonical_json(dict(config.tasks[task.name].dataset_kwargs))
    memory = (config.memory, config.memory_args, config.budget, config.prompt)
    return task.name, config.frames or SHOWN, kwargs, *map(str, memory)


class NoneOfAnotherSet:
    """Every record is of a question of the set, with the set's own words and gold answers."""

    name: ClassVar[str] = "questions"
    reason: ClassVar[str] = "an edited question or key makes a wrong reply right"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.tasks:
            unknown = [str(it.key) for it in task.records if it.key not in task.units]
            if unknown:
                yield Problem(
                    self.name,
                    f"{task.name}: {count('records', unknown)} are of no question of the set; take "
                    "them out",
                )
            edited = [str(it.key) for it in task.records if self._is_edited(task, it)]
            if edited:
                yield Problem(
                    self.name,
                    f"{task.name}: {count('questions', edited)} have other words or gold answers "
                    "than in the set",
                )
        for run in case.submission.runs:
            foreign = [text for text in run.unread if "again" not in text]
            if foreign:
                yield Problem(
                    self.name, f"{run.path.name}: {count('rows', foreign)} cannot be scored"
                )

    @staticmethod
    def _is_edited(task: Expected, record: Any) -> bool:
        unit = task.units.get(record.key)
        if unit is None:
            return False
        theirs, ours = record.payload, unit.payload
        return (theirs.question, theirs.answers) != (ours.question, ours.answers)
